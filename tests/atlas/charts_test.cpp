#include "common/unwrap/charts.h"

#include "tests/atlas/shapes.h"

namespace kiln {
namespace {
using namespace test;

TEST(Charts, SharedSidesConnectAndGapsPart) {
  EXPECT_EQ(authored_charts(plane(8, 1, Uv::kUnit))->chart_count, 1u);
  const MeshCharts six = *authored_charts(box(Vec3(1), Uv::kUnit));
  EXPECT_EQ(six.chart_count, 6u);
  for (uint32_t t = 0; t < 12; ++t) EXPECT_EQ(six.chart_of_face[t], t / 2);
  EXPECT_FALSE(six.generated);
}

TEST(Charts, DuplicatedVerticesStillConnect) {
  EXPECT_EQ(authored_charts(unshared(plane(8, 1, Uv::kUnit)))->chart_count, 1u);
}

TEST(Charts, SameCoordinatesElsewhereInSpaceAreAnotherChart) {
  Mesh m = plane(1, 1, Uv::kUnit);  // a second storey with the same TEXCOORD_1
  const Mesh copy = m;
  for (const Vec3& p : copy.positions) m.positions.push_back(p + Vec3(0, 3, 0));
  m.normals.insert(m.normals.end(), copy.normals.begin(), copy.normals.end());
  m.uv[1].insert(m.uv[1].end(), copy.uv[1].begin(), copy.uv[1].end());
  for (const UVec3& t : copy.triangles) m.triangles.push_back(t + UVec3(4));
  EXPECT_EQ(authored_charts(m)->chart_count, 2u);
  EXPECT_TRUE(charts_for_packing(m, {}, 1).complaint.empty());  // packed apart, they do not overlap
}

TEST(Charts, FoldPartsCharts) {
  Mesh m = plane(2, 1, Uv::kUnit);
  for (Vec2& uv : m.uv[1]) uv.x = std::abs(uv.x - 0.5f);  // mirrored halves share their coordinates
  const MeshCharts charts = *authored_charts(m);
  EXPECT_EQ(charts.chart_count, 2u);
  EXPECT_EQ(self_overlap(charts), 0.0);
}

TEST(Charts, SelfOverlapIsMeasuredAndReplaced) {
  Mesh m = spiral(3, 32);
  for (const Vec3& p : m.positions) m.uv[1].push_back({p.x, p.z});
  EXPECT_GT(self_overlap(*authored_charts(m)), 0.5);
  const ChartsForPacking made = charts_for_packing(m, {}, 1);
  EXPECT_TRUE(made.charts.generated);
  EXPECT_NE(made.complaint.find("overlap themselves"), std::string::npos) << made.complaint;
  EXPECT_LT(self_overlap(made.charts), 1e-4);
  EXPECT_EQ(self_overlap(*authored_charts(plane(16, 1, Uv::kUnit))), 0.0);
}

TEST(Charts, UnusableCoordinatesAreRefusedWithReasons) {
  EXPECT_EQ(authored_charts(plane(2, 1, Uv::kNone)).error().message, "has no TEXCOORD_1");
  Mesh bad = plane(2, 1, Uv::kUnit);
  bad.uv[1][4].x = NAN;
  EXPECT_NE(authored_charts(bad).error().message.find("not a number"), std::string::npos);
  Mesh flat = plane(2, 1, Uv::kUnit);
  for (Vec2& uv : flat.uv[1]) uv.y = 0.25f;
  EXPECT_NE(authored_charts(flat).error().message.find("no area"), std::string::npos);
  EXPECT_TRUE(charts_for_packing(flat, {}, 1).charts.generated);
}

TEST(Charts, FarCoordinatesAreBroughtNear) {
  Mesh m = plane(4, 1, Uv::kUnit);
  for (Vec2& uv : m.uv[1]) uv += Vec2(1000, -77);
  const ChartsForPacking made = charts_for_packing(m, {}, 1);
  EXPECT_FALSE(made.charts.generated);
  for (const Vec2& uv : made.charts.corner_uv) {
    EXPECT_GE(std::min(uv.x, uv.y), 0.0f);
    EXPECT_LE(std::max(uv.x, uv.y), 1.0f);
  }
}

TEST(Charts, TrianglesByChartListsEachOnce) {
  const MeshCharts charts = *authored_charts(box(Vec3(1), Uv::kUnit));
  const ChartTriangles by = triangles_by_chart(charts);
  std::vector<int> seen(12);
  for (uint32_t c = 0; c < charts.chart_count; ++c)
    for (uint32_t t : by.of(c)) {
      EXPECT_EQ(charts.chart_of_face[t], c);
      ++seen[t];
    }
  EXPECT_EQ(seen, std::vector<int>(12, 1));
}

}  // namespace
}  // namespace kiln
