// Where probes are put.
#include "coordinator/scene/probes/bricks.h"

#include <set>

#include "coordinator/scene/probes/probes.h"
#include "tests/analytic/scene_maker.h"

namespace kiln::test {
namespace {

Scene floor_and_crate() {
  SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.quad({-8, 0, -8}, {0, 0, 16}, {16, 0, 0});
  m.box({1, 0, 1}, {2, 1, 2}, false);
  return m.take();
}

ProbeBox box(const DVec3& low, const DVec3& high, double spacing, double most) {
  ProbeBox b;
  b.name = "test";
  b.low = low;
  b.high = high;
  b.spacing = spacing;
  b.max_spacing = most;
  return b;
}

TEST(ProbeBricks, OneSpacingIsAGrid) {
  const Scene scene = floor_and_crate();
  const auto placed = place_bricks(box({0, 0, 0}, {3, 3, 6}, 1, 1), world_triangles(scene), 0, 1000);
  ASSERT_TRUE(placed);
  EXPECT_EQ(placed->volume.bricks.size(), 2u);
  EXPECT_EQ(placed->points.size(), 4u * 4 * 7);
}

// The finest bricks are at surfaces, the coarsest far off; neighbours differ by one level at most; each
// leaf's point is a probe; every place has the brick that contains it.
TEST(ProbeBricks, AreFinerNearSurfaces) {
  const Scene scene = floor_and_crate();
  const auto placed =
      place_bricks(box({-6, -0.25, -6}, {6, 11.75, 6}, 0.25, 2), world_triangles(scene), 10, 100000);
  ASSERT_TRUE(placed);
  const ProbeVolume& v = placed->volume;
  EXPECT_EQ(v.levels, 4u);
  EXPECT_EQ(v.bricks[find_brick(v, {24, 2, 24})].level, 0u);
  EXPECT_GE(v.bricks[find_brick(v, {24, 40, 24})].level, 2u);
  std::set<uint32_t> used;
  for (uint32_t i = 0; i < v.bricks.size(); ++i) {
    const ProbeBrick& b = v.bricks[i];
    if (b.children) continue;
    used.insert(b.probes.begin(), b.probes.end());
    const DVec3 middle = DVec3(b.corner) + DVec3(0.5 * b.size());
    EXPECT_EQ(find_brick(v, middle), i);
    for (int side = 0; side < 27; ++side) {
      const DVec3 step(side % 3 - 1, side / 3 % 3 - 1, side / 9 - 1);
      const DVec3 at = middle + step * (0.5 * b.size() + 0.01);
      const DVec3 end = DVec3(v.roots * v.root_size());
      if (std::min({at.x, at.y, at.z}) < 0 || at.x > end.x || at.y > end.y || at.z > end.z) continue;
      const uint32_t other = v.bricks[find_brick(v, at)].level;
      EXPECT_LE(other, b.level + 1);
      if (side == 4 || side == 10 || side == 12 || side == 14 || side == 16 || side == 22)
        EXPECT_EQ(other > b.level, (b.coarser >> side & 1) != 0) << i << " side " << side;
    }
  }
  EXPECT_EQ(used.size(), placed->points.size());
  EXPECT_EQ(*used.begin(), 10u);
  // A quarter of what one spacing would need.
  EXPECT_LT(placed->points.size(), 49u * 49 * 49 / 4);
}

TEST(ProbePlaces, InsideAreInactiveOrMovedOut) {
  const Scene scene = floor_and_crate();
  const auto layout = lay_out_probes(scene, {box({0.05, 0.05, 0.05}, {3.05, 3.05, 3.05}, 0.5, 0.5)}, {});
  ASSERT_TRUE(layout) << layout.error().message;
  size_t inside = 0, moved = 0;
  for (size_t i = 0; i < layout->size(); ++i) {
    const Vec3 p = layout->place[i], g = layout->grid[i];
    const bool in_crate = g.x > 1 && g.x < 2 && g.y > 0 && g.y < 1 && g.z > 1 && g.z < 2;
    const bool is_out = p.x < 1 || p.x > 2 || p.y > 1 || p.z < 1 || p.z > 2;
    EXPECT_TRUE(is_out || layout->state[i] == ProbeState::kInactive) << i;
    EXPECT_LE(max_component(glm::abs(p - g)), 0.45f * 0.5f + 1e-6f);
    EXPECT_TRUE(in_crate || layout->state[i] != ProbeState::kInactive) << i;
    inside += in_crate;
    moved += layout->state[i] == ProbeState::kMoved;
  }
  EXPECT_EQ(inside, 8u);
  EXPECT_GT(moved, 3u);
}

TEST(ProbePlaces, ABudgetIsSolvedForTheSpacing) {
  const Scene scene = floor_and_crate();
  ProbeLimits limits;
  limits.most = 300;
  const ProbeBox wish = box({-8, 0.1, -8}, {8, 3, 8}, 0.5, 0.5);
  EXPECT_FALSE(lay_out_probes(scene, {wish}, limits));
  limits.may_coarsen = true;
  const auto layout = lay_out_probes(scene, {wish}, limits);
  ASSERT_TRUE(layout);
  EXPECT_LE(layout->size(), 300u);
  EXPECT_GT(layout->size(), 100u);
  EXPECT_EQ(layout->notes.size(), 1u);
}

// Two rooms beside a wall with a probe in it: its light comes from one of them.
TEST(ProbePlaces, StandInsAreOnOneSide) {
  SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.box({0, 0, 0}, {8, 3, 4}, true);
  m.box({3.4f, -0.1f, -0.1f}, {4.6f, 3.1f, 4.1f}, false);
  const Scene scene = m.take();
  const auto layout = lay_out_probes(scene, {box({0.9, 0.5, 0.5}, {6.9, 2.5, 3.5}, 1, 1)}, {});
  ASSERT_TRUE(layout) << layout.error().message;
  const auto sources = sources_of_inactive(scene, *layout);
  size_t filled = 0;
  for (size_t i = 0; i < layout->size(); ++i) {
    if (layout->state[i] != ProbeState::kInactive) {
      EXPECT_TRUE(sources[i].empty());
      continue;
    }
    float left = 0, right = 0;
    for (const ProbeSource& s : sources[i]) (layout->place[s.probe].x < 4 ? left : right) += s.weight;
    if (sources[i].empty()) continue;
    ++filled;
    EXPECT_NEAR(left + right, 1, 1e-5f);
    EXPECT_TRUE(left == 0 || right == 0) << left << " " << right;
  }
  EXPECT_GT(filled, 3u);
}

}  // namespace
}  // namespace kiln::test
