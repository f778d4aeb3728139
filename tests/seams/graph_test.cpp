// Which borders are seams, and which are not.
#include "coordinator/bake/seams/match.h"
#include "tests/seams/pieces.h"
#include "tests/seams/plain_seams.h"

namespace kiln {
namespace {
using namespace test;

struct Graph {
  std::vector<SeamStretch> stretches;
  std::vector<SeamPoint> points;
  double metres = 0;
};

Graph graph_of(const Scene& scene, float texels_per_metre = 8, SeamSettings settings = {}) {
  const Atlas atlas = packed(scene, texels_per_metre);
  const std::vector<BorderEdge> edges = border_edges(scene, atlas);
  Graph g;
  g.stretches = coincident_stretches(edges, settings);
  g.points = seam_points(edges, g.stretches, atlas.contacts, settings);
  for (const SeamStretch& s : g.stretches) g.metres += s.metres;
  return g;
}

Mat4x3 turned_about_y(double turns, const Vec3& to) {
  const double a = 2 * M_PI * turns;
  const auto c = static_cast<float>(std::cos(a)), s = static_cast<float>(std::sin(a));
  return Mat4x3(Vec3(c, 0, -s), Vec3(0, 1, 0), Vec3(s, 0, c), to);
}

TEST(SeamGraph, PiecesOfAnyTessellationJoinAlongTheirWholeSides) {
  // Vertical cuts: three of 1.5 m below and three above; the horizontal one is 8 m.
  const Graph g = graph_of(wall_of_eight().scene);
  EXPECT_NEAR(g.metres, 3 * 1.5 + 3 * 1.5 + 8, 1e-3);
}

TEST(SeamGraph, AgreesWithEverySideHeldAgainstEveryOther) {
  const Scene scene = wall_of_eight().scene;
  const Atlas atlas = packed(scene, 8);
  const Graph g = graph_of(scene);
  // Every place that the slow search finds lies within the spacing of the points from one of the graph's.
  for (const PlainPoint& p : plain_seam_points(scene, atlas, 300)) {
    double nearest = 1e9;
    for (const SeamPoint& q : g.points)
      for (int turn = 0; turn < 2; ++turn)
        if (q.page[0] == p.page[turn] && q.page[1] == p.page[1 - turn])
          nearest = std::min(
              nearest, std::max(length(q.texel[0] - p.texel[turn]), length(q.texel[1] - p.texel[1 - turn])));
    EXPECT_LT(nearest, 0.1925) << p.world.x << " " << p.world.y;  // half of a quarter, and what 5 mm hide
  }
}

TEST(SeamGraph, AShortSideJoinsThePartOfALongOneItLiesOn) {
  Pieces t;
  t.add(panel(3, 1, 1, 1), moved({0, 0, 0})).add(panel(1, 1, 1, 1), moved({1.2f, 1, 0}));
  const Graph g = graph_of(t.scene);
  EXPECT_NEAR(g.metres, 1, 1e-5);
  for (const SeamStretch& s : g.stretches) {
    const double share =
        std::abs(s.side[0].to - s.side[0].from) * 3 + std::abs(s.side[1].to - s.side[1].from);
    EXPECT_NEAR(share, 2 * s.metres, 1e-5);  // of three metres, and of one
  }
}

TEST(SeamGraph, ScaledAndMirroredInstancesJoin) {
  Pieces p;
  const Mesh unit = panel(1, 1, 1, 1);
  p.add(unit, Mat4x3(Vec3(2, 0, 0), Vec3(0, 3, 0), Vec3(0, 0, 5), Vec3(0.0f)));
  p.add(unit, Mat4x3(Vec3(-2, 0, 0), Vec3(0, 3, 0), Vec3(0, 0, 1), Vec3(4, 0, 0)));
  EXPECT_NEAR(graph_of(p.scene).metres, 3, 1e-5);
}

TEST(SeamGraph, FarFromTheOriginAndAtAnyScale) {
  for (const float scale : {1e-3f, 1.0f, 1e4f}) {
    Pieces p;
    const Mesh unit = panel(scale, scale, 1, 1);
    const Vec3 far(1000 * scale, 0, 0);
    p.add(unit, moved(far)).add(unit, moved(far + Vec3(scale, 0, 0)));
    EXPECT_NEAR(graph_of(p.scene, 8 / scale).metres / scale, 1, 1e-3) << scale;
  }
}

TEST(SeamGraph, AGapIsASeamUntilItCouldBeSeen) {
  // A texel is an eighth of a metre, the tolerance an eighth of that: 15.6 mm.
  for (const auto& [gap, seams] :
       {std::pair{0.001f, true}, {0.014f, true}, {0.018f, false}, {0.125f, false}}) {
    Pieces p;
    const Mesh unit = panel(1, 1, 1, 1);
    p.add(unit, moved({0, 0, 0})).add(unit, moved({1 + gap, 0, 0}));
    EXPECT_EQ(!graph_of(p.scene).stretches.empty(), seams) << gap;
  }
}

TEST(SeamGraph, SheetsBackToBackAndOnOneAnotherHaveNone) {
  const Mesh unit = panel(1, 1, 1, 1);
  Pieces back;
  back.add(unit, moved({0, 0, 0})).add(unit, turned_about_y(0.5, {1, 0, 0}));
  EXPECT_TRUE(graph_of(back.scene).stretches.empty());
  Pieces stacked;  // a poster on a wall
  stacked.add(unit, moved({0, 0, 0})).add(unit, moved({0, 0, 0.004f}));
  EXPECT_TRUE(graph_of(stacked.scene).stretches.empty());
}

TEST(SeamGraph, ACreaseIsJoinedUpToTheAngleAndNotBeyond) {
  for (const double degrees : {1.0, 4.0, 6.0, 45.0, 90.0}) {
    Pieces p;
    const Mesh unit = panel(1, 1, 1, 1);
    p.add(unit, moved({0, 0, 0})).add(unit, turned_about_y(degrees / 360, {1, 0, 0}));
    EXPECT_EQ(!graph_of(p.scene).stretches.empty(), degrees < 5) << degrees;
    EXPECT_EQ(!graph_of(p.scene, 8, {.angle_degrees = 60}).stretches.empty(), degrees < 60) << degrees;
  }
  Pieces box;
  box.add(cube(1), moved({0, 0, 0}));
  EXPECT_TRUE(graph_of(box.scene).points.empty());
}

TEST(SeamGraph, WhereAWallStandsOnAFloorIsNone) {
  // Four floor pieces; walls of two sheets stand along the middle of two of them and on the cut to the
  // others.
  Pieces p;
  const Mesh unit = panel(2, 2, 1, 1);
  const auto floor = [&](float x, float z) {
    p.add(unit, Mat4x3(Vec3(1, 0, 0), Vec3(0, 0, -1), Vec3(0, 1, 0), Vec3(x, 0, z + 2)));
  };
  floor(0, 0), floor(2, 0), floor(0, 2), floor(2, 2);
  const auto across = [](const Graph& g) {  // texels of seam
    double sum = 0;
    for (const SeamPoint& q : g.points) sum += q.texels;
    return sum / 8;
  };
  EXPECT_NEAR(across(graph_of(p.scene)), 8, 1e-3);
  const Mesh wall = panel(4, 1, 1, 1);
  for (const float z : {1.0f, 2.0f}) {
    p.add(wall, moved({0, 0, z}));
    p.add(wall, turned_about_y(0.5, {4, 0, z}));
  }
  // The cut along z is left: 4 metres, less what the walls cross.
  const double left = across(graph_of(p.scene));
  EXPECT_LE(left, 4.2);
  EXPECT_GE(left, 3.5);
}

TEST(SeamGraph, ARoundColumnClosesOnItself) {
  // All charts' vertical borders of a mantle with smooth normals, each 2 metres; as many as there are charts.
  Pieces p;
  p.add(mantle(0.5f, 2, 24, 1), moved({0, 0, 0}));
  const uint32_t charts = packed(p.scene, 8).of_instance(0).chart_count;
  EXPECT_GE(charts, 1u);
  EXPECT_NEAR(graph_of(p.scene).metres, 2.0 * charts, 1e-3);
}

TEST(SeamGraph, ASeamWithinOneChartCounts) {
  // One chart: a strip that goes round and meets its own beginning.
  Mesh m = mantle(0.5f, 1, 24, 1);
  for (size_t v = 0; v < m.positions.size(); ++v)
    m.uv[1].push_back({static_cast<float>(v / 2) / 24, static_cast<float>(v % 2) / 3});
  Pieces p;
  p.add(m, moved({0, 0, 0}));
  ASSERT_EQ(packed(p.scene, 8).of_instance(0).chart_count, 1u);
  EXPECT_NEAR(graph_of(p.scene).metres, 1, 1e-4);
}

TEST(SeamGraph, AHundredSheetsOnOnePlaceStayBounded) {
  Pieces p;
  for (int i = 0; i < 400; ++i) p.add(panel(1, 1, 1, 1), moved({i % 2 ? 1.0f : 0.0f, 0, 0}));
  const Graph g = graph_of(p.scene, 4);
  EXPECT_GE(g.stretches.size(), 200u);
  EXPECT_LE(g.stretches.size(), 200u * 200u);
}

}  // namespace
}  // namespace kiln
