#include "common/unwrap/unwrap.h"

#include "common/raster/triangle2.h"
#include "common/unwrap/charts.h"
#include "common/unwrap/layers.h"
#include "tests/unwrap/hard_meshes.h"
#include "tests/unwrap/solids.h"

namespace kiln {
namespace {
using namespace test;

double surface_area(const Mesh& m, size_t t) {
  const UVec3& v = m.triangles[t];
  const DVec3 a(m.positions[v.x]), b(m.positions[v.y]), c(m.positions[v.z]);
  return 0.5 * length(cross(b - a, c - a));
}

// What the header promises, asked of the result alone. `area_error`: relative, of the whole mesh.
void expect_valid(const Mesh& m, const MeshCharts& charts, double area_error) {
  ASSERT_EQ(charts.chart_of_face.size(), m.triangles.size()) << m.name;
  ASSERT_EQ(charts.corner_uv.size(), 3 * m.triangles.size()) << m.name;
  double flat = 0, solid = 0;
  std::vector<uint8_t> used(charts.chart_count);
  for (size_t t = 0; t < m.triangles.size(); ++t) {
    ASSERT_LT(charts.chart_of_face[t], charts.chart_count) << m.name;
    used[charts.chart_of_face[t]] = 1;
    const Triangle2 uv = uv_triangle(charts, t);
    for (const DVec2& c : uv.c) {
      ASSERT_TRUE(std::isfinite(c.x) && std::isfinite(c.y)) << m.name;
      ASSERT_GE(std::min(c.x, c.y), 0.0) << m.name;
    }
    EXPECT_GE(area2(uv), 0.0) << m.name << " triangle " << t;
    flat += 0.5 * area2(uv);
    solid += surface_area(m, t);
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), 0), 0) << m.name << " has empty charts";
  EXPECT_NEAR(flat, solid, area_error * solid) << m.name;
  EXPECT_EQ(self_overlap(charts), 0.0) << m.name;
}

std::vector<Mesh> meshes() {
  std::vector<Mesh> all = {box({1, 2, 3}, Uv::kNone),
                           sphere(24, 1),
                           spiral(4, 48),
                           soup(300, 7),
                           unshared(sphere(9, 2)),
                           torus(24, 2, 0.7f),
                           blob(40),
                           terrain(40),
                           tube(32, 8),
                           tree_of_cones(5),
                           letters(6),
                           moebius(60),
                           klein(24),
                           fan(17),
                           plane(5, 2, Uv::kNone)};
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    all.push_back(with_noise(sphere(10, 1), 0.02f * static_cast<float>(seed * seed), seed));
    all.push_back(with_noise(klein(10), 0.3f, seed));
    all.push_back(soup(60, seed));
    Mesh twice = with_noise(torus(10, 2, 1), 0.2f, seed);
    const std::vector<UVec3> once = twice.triangles;
    twice.triangles.insert(twice.triangles.end(), once.begin(), once.end());
    for (UVec3 t : once) twice.triangles.push_back({t.x, t.z, t.y});
    all.push_back(twice);
  }
  return all;
}

// Corners are floats in metres and charts are scaled in double: the area is theirs to 1e-5.
TEST(Unwrap, EveryMeshGetsChartsThatCanBeUsed) {
  const UnwrapSettings settings;
  for (const Mesh& m : meshes()) {
    const UnwrapResult made = unwrap(m, settings, 1);
    expect_valid(m, made.charts, 1e-5);
    EXPECT_TRUE(made.charts.generated);
    EXPECT_EQ(made.limited, "") << m.name;
    EXPECT_LE(made.stretch.l2, settings.limits.l2) << m.name;
    EXPECT_LE(made.stretch.linf, settings.limits.linf) << m.name;
  }
}

// Every pair of triangles of a chart, the slow way.
TEST(Unwrap, NoTwoTrianglesOfAChartMeet) {
  for (const Mesh& m : {sphere(12, 1), spiral(4, 24), soup(300, 7), klein(12), moebius(30)}) {
    const MeshCharts charts = unwrap(m, {}, 1).charts;
    const ChartTriangles by = triangles_by_chart(charts);
    size_t pairs = 0;
    for (uint32_t c = 0; c < charts.chart_count; ++c)
      for (size_t i = 0; i < by.of(c).size(); ++i)
        for (size_t k = 0; k < i; ++k)
          pairs += interiors_meet(uv_triangle(charts, by.of(c)[i]), uv_triangle(charts, by.of(c)[k]), 1e-5);
    EXPECT_EQ(pairs, 0u) << m.name;
  }
}

TEST(Unwrap, ABoxHasSixChartsInMetres) {
  const UnwrapResult made = unwrap(box({1, 2, 3}, Uv::kNone), {}, 1);
  EXPECT_EQ(made.charts.chart_count, 6u);
  for (const Vec2& uv : made.charts.corner_uv) EXPECT_LE(std::max(uv.x, uv.y), 3.0f + 1e-6f);
  EXPECT_NEAR(made.stretch.linf, 1.0, 1e-6);
}

TEST(Unwrap, DevelopableShapesUnrollWithoutStretch) {
  const UnwrapResult made = unwrap(tube(32, 8), {}, 1);
  EXPECT_EQ(made.charts.chart_count, 1u);  // cut along one line
  EXPECT_NEAR(made.stretch.linf, 1.0, 1e-4);
  EXPECT_LE(unwrap(sphere(24, 1), {}, 1).charts.chart_count, 4u);
  EXPECT_LE(unwrap(torus(24, 2, 0.7f), {}, 1).charts.chart_count, 8u);
}

TEST(Unwrap, SharpSidesAreSeams) {
  UnwrapSettings settings;
  settings.crease_degrees = 180;
  const uint32_t folded = unwrap(box({1, 2, 3}, Uv::kNone), settings, 1).charts.chart_count;
  EXPECT_LT(folded, 6u);
  settings.crease_degrees = 0.5f;
  const Mesh ball = sphere(12, 1);  // smooth shading: no side is sharp, whatever the crease
  EXPECT_LE(unwrap(ball, settings, 1).charts.chart_count, 4u);
}

TEST(Unwrap, StackedCopiesComeApart) {
  Mesh m = plane(4, 1, Uv::kNone);
  const std::vector<UVec3> once = m.triangles;
  for (int copy = 0; copy < 3; ++copy) m.triangles.insert(m.triangles.end(), once.begin(), once.end());
  const MeshCharts charts = unwrap(m, {}, 1).charts;
  EXPECT_EQ(charts.chart_count, 4u);
  expect_valid(m, charts, 1e-5);
}

TEST(Unwrap, DegenerateFacesLieWithANeighbour) {
  Mesh m = plane(2, 1, Uv::kNone);
  const uint32_t good = unwrap(m, {}, 1).charts.chart_count;
  m.triangles.push_back({0, 0, 1});
  m.triangles.push_back({3, 3, 3});
  m.triangles.push_back({0, 1, 2});  // a line
  const MeshCharts charts = unwrap(m, {}, 1).charts;
  EXPECT_EQ(charts.chart_count, good);
  expect_valid(m, charts, 1e-5);
  Mesh points = m;
  points.triangles = {{0, 0, 0}, {0, 1, 2}};
  expect_valid(points, unwrap(points, {}, 1).charts, 1);
  EXPECT_EQ(unwrap(Mesh{}, {}, 1).charts.chart_count, 0u);
}

TEST(Unwrap, ThreadsChangeNothing) {
  for (const Mesh& m : {blob(40), with_noise(klein(16), 0.3f, 5)}) {
    const UnwrapResult one = unwrap(m, {}, 1);
    for (unsigned threads : {2u, 5u}) {
      const UnwrapResult many = unwrap(m, {}, threads);
      EXPECT_EQ(one.charts.corner_uv, many.charts.corner_uv);
      EXPECT_EQ(one.charts.chart_of_face, many.charts.chart_of_face);
    }
  }
}

// Layers do not keep the area (a face at 54 degrees has half of its own) but everything else.
TEST(Unwrap, LimitsTakeTheCheapWay) {
  for (uint64_t work : {uint64_t{0}, uint64_t{2000}, uint64_t{40000}}) {
    UnwrapSettings settings;
    settings.max_work = work;
    for (const Mesh& m : {blob(24), soup(300, 3), with_noise(torus(16, 2, 1), 0.4f, 9)}) {
      const UnwrapResult made = unwrap(m, settings, 1);
      expect_valid(m, made.charts, 0.5);
      if (work == 0 && m.name != "soup")
        EXPECT_NE(made.limited.find("projected along the axes"), std::string::npos);
      EXPECT_LE(made.stretch.linf, 2.0);
    }
  }
  UnwrapSettings few;
  few.max_charts = 600;
  const Mesh m = soup(3000, 11);
  const UnwrapResult made = unwrap(m, few, 1);
  expect_valid(m, made.charts, 0.5);
  EXPECT_LE(made.charts.chart_count, 600u);
  EXPECT_NE(made.limited, "");
}

// What bounds the number of charts is said beside each.
TEST(Unwrap, HardMeshesNeedFewCharts) {
  struct Case {
    Mesh mesh;
    uint32_t charts;
    double l2;
  };
  const Case cases[] = {
      {height_field(100), 1, 1.05},  // nothing overhangs: one chart
      {cave(90), 90, 1.03},          // closed, bends by 45 degrees a metre
      {vehicle(60), 1060,
       1.03},  // 84 panels with 4 edges each, 72 boxes of 6 sides, 60 bolts of 3 parts, 4 tyres
  };
  for (const Case& c : cases) {
    const UnwrapResult one = unwrap(c.mesh, {}, 1);
    expect_valid(c.mesh, one.charts, 1e-5);
    EXPECT_LE(one.charts.chart_count, c.charts) << c.mesh.name;
    EXPECT_LE(one.stretch.l2, c.l2) << c.mesh.name;
    EXPECT_LE(one.stretch.linf, UnwrapSettings().limits.linf) << c.mesh.name;
    const UnwrapResult many = unwrap(c.mesh, {}, 3);
    EXPECT_EQ(one.charts.corner_uv, many.charts.corner_uv) << c.mesh.name;
    EXPECT_EQ(one.charts.chart_of_face, many.charts.chart_of_face) << c.mesh.name;
  }
}

// A wall on a floor: three faces meet at its foot, and the floor goes on beneath it.
TEST(Unwrap, AFloorGoesOnBeneathAWall) {
  for (int first = 0; first < 3; ++first) {  // whichever is numbered first
    Mesh m;
    m.positions = {{0, 0, 0}, {0, 0, 4}, {4, 0, 4}, {4, 0, 0}, {-4, 0, 0}, {-4, 0, 4}, {0, 3, 0}, {0, 3, 4}};
    m.normals.assign(8, Vec3(0, 1, 0));
    m.normals[6] = m.normals[7] = Vec3(1, 0, 0);
    const std::vector<std::vector<UVec3>> parts = {
        {{0, 1, 2}, {0, 2, 3}}, {{0, 4, 5}, {0, 5, 1}}, {{0, 6, 7}, {0, 7, 1}}};
    for (size_t k = 0; k < 3; ++k)
      for (const UVec3& t : parts[(k + static_cast<size_t>(first)) % 3]) m.triangles.push_back(t);
    const MeshCharts charts = unwrap(m, {}, 1).charts;
    std::vector<uint32_t> of_floor;
    for (size_t t = 0; t < m.triangles.size(); ++t)
      if (std::max({m.triangles[t].x, m.triangles[t].y, m.triangles[t].z}) < 6)
        of_floor.push_back(charts.chart_of_face[t]);
    EXPECT_EQ(of_floor, std::vector<uint32_t>(4, of_floor[0])) << first;
    EXPECT_EQ(charts.chart_count, 2u) << first;
  }
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
