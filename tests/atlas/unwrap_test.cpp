#include "common/unwrap/charts.h"
#include "common/raster/triangle2.h"
#include "common/unwrap/unwrap_simple.h"
#include "tests/atlas/shapes.h"

namespace kiln {
namespace {
using namespace test;

// Every pair of triangles of a chart, the slow way.
size_t overlapping_pairs(const MeshCharts& charts) {
  const ChartTriangles by = triangles_by_chart(charts);
  size_t pairs = 0;
  for (uint32_t c = 0; c < charts.chart_count; ++c) {
    const auto list = by.of(c);
    for (size_t i = 0; i < list.size(); ++i)
      for (size_t k = 0; k < i; ++k)
        pairs += interiors_meet(uv_triangle(charts, list[i]), uv_triangle(charts, list[k]), 1e-5);
  }
  return pairs;
}

size_t flips(const MeshCharts& charts) {
  size_t count = 0;
  for (size_t t = 0; t < charts.chart_of_face.size(); ++t) count += area2(uv_triangle(charts, t)) < 0;
  return count;
}

TEST(Unwrap, ABoxHasSixChartsInMetres) {
  const MeshCharts charts = unwrap_simple(box({1, 2, 3}, Uv::kNone), 60);
  EXPECT_EQ(charts.chart_count, 6u);
  EXPECT_TRUE(charts.generated);
  for (const Vec2& uv : charts.corner_uv) {
    EXPECT_GE(std::min(uv.x, uv.y), 0.0f);
    EXPECT_LE(std::max(uv.x, uv.y), 3.0f);
  }
  double area = 0;
  for (size_t t = 0; t < 12; ++t) area += 0.5 * std::abs(area2(uv_triangle(charts, t)));
  EXPECT_NEAR(area, 22.0, 1e-4);
}

TEST(Unwrap, NeverOverlapsNorFlips) {
  for (const Mesh& m :
       {sphere(24, 1), spiral(4, 48), soup(300, 7), box({1, 1, 1}, Uv::kNone), unshared(sphere(9, 2))}) {
    const MeshCharts charts = unwrap_simple(m, 60);
    EXPECT_EQ(overlapping_pairs(charts), 0u) << m.name;
    EXPECT_EQ(flips(charts), 0u) << m.name;
    for (uint32_t chart : charts.chart_of_face) EXPECT_LT(chart, charts.chart_count);
  }
  EXPECT_LE(unwrap_simple(sphere(24, 1), 60).chart_count, 16u);
  EXPECT_LE(unwrap_simple(spiral(4, 48), 60).chart_count, 8u);
}

TEST(Unwrap, StackedCopiesComeApart) {
  Mesh m = plane(4, 1, Uv::kNone);
  const std::vector<UVec3> once = m.triangles;
  for (int copy = 0; copy < 3; ++copy) m.triangles.insert(m.triangles.end(), once.begin(), once.end());
  const MeshCharts charts = unwrap_simple(m, 60);
  EXPECT_EQ(overlapping_pairs(charts), 0u);
  EXPECT_GE(charts.chart_count, 4u);
}

TEST(Unwrap, DegenerateFacesDoNoHarm) {
  Mesh m = plane(2, 1, Uv::kNone);
  m.triangles.push_back({0, 0, 1});
  m.triangles.push_back({3, 3, 3});
  m.triangles.push_back({0, 1, 2});  // a line
  const MeshCharts charts = unwrap_simple(m, 60);
  for (uint32_t chart : charts.chart_of_face) EXPECT_LT(chart, charts.chart_count);
  for (const Vec2& uv : charts.corner_uv) EXPECT_TRUE(std::isfinite(uv.x) && std::isfinite(uv.y));
  EXPECT_EQ(unwrap_simple(Mesh{}, 60).chart_count, 0u);
}

TEST(Unwrap, CreaseDecidesWhereChartsEnd) {
  const uint32_t wide = unwrap_simple(sphere(16, 1), 70).chart_count;
  const uint32_t narrow = unwrap_simple(sphere(16, 1), 15).chart_count;
  EXPECT_LT(3 * wide, narrow);
}

TEST(Interiors, MeetOnlyWhenTheyShareArea) {
  const Triangle2 a{{{0, 0}, {1, 0}, {0, 1}}};
  EXPECT_FALSE(interiors_meet(a, Triangle2{{{1, 0}, {1, 1}, {0, 1}}}, 1e-9));  // a side in common
  EXPECT_FALSE(interiors_meet(a, Triangle2{{{1, 0}, {2, 0}, {2, 1}}}, 1e-9));  // a corner in common
  EXPECT_TRUE(interiors_meet(a, Triangle2{{{0.9, 0}, {1, 1}, {0, 0.9}}}, 1e-9));
  EXPECT_TRUE(interiors_meet(a, a, 1e-9));
  EXPECT_TRUE(interiors_meet(a, Triangle2{{{0, 1}, {1, 0}, {0, 0}}}, 1e-9));  // whichever way it winds
}

}  // namespace
}  // namespace kiln
