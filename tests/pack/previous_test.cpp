#include "common/atlas/previous_layout.h"
#include "tests/atlas/shapes.h"

namespace kiln {
namespace {
using namespace test;

Scene street() {
  Scene scene;
  scene.meshes = {box({1, 2, 0.5f}, Uv::kUnit), sphere(12, 1), plane(3, 2, Uv::kUnit)};
  for (int i = 0; i < 20; ++i)
    scene.instances.push_back(
        instance(i % 3, i % 2 ? "lamp" : "house " + std::to_string(i), at({3.0f * i, 0, 0})));
  for (size_t m = 0; m < scene.meshes.size(); ++m) scene.meshes[m].name = "mesh " + std::to_string(m);
  return scene;
}

// Placements of the instances of `now` that differ from those of the instances `before` was made of.
uint32_t moved(const Atlas& before, const Atlas& now, const std::vector<uint32_t>& earlier) {
  uint32_t count = 0;
  for (uint32_t i = 0; i < earlier.size(); ++i)
    for (uint32_t c = 0; c < now.of_instance(i).chart_count; ++c) {
      const ChartPlacement& a = before.placements[before.instance_first_chart[earlier[i]] + c];
      const ChartPlacement& b = now.placements[now.instance_first_chart[i] + c];
      count += a.page != b.page || a.turned != b.turned || a.scale != b.scale || a.offset != b.offset;
    }
  return count;
}

std::vector<uint32_t> numbers(uint32_t count, uint32_t without = ~0u) {
  std::vector<uint32_t> n;
  for (uint32_t i = 0; i < count; ++i)
    if (i != without) n.push_back(i);
  return n;
}

TEST(PreviousLayout, AnObjectMoreMovesNothing) {
  Scene scene = street();
  for (uint32_t side : {8192u, 100u}) {
    AtlasSettings settings = pack_at(6);
    settings.max_page_size = side;
    const Atlas before = *build_atlas(scene, settings);
    const PreviousLayout previous = previous_layout_of(scene, before);
    Scene more = scene;
    more.instances.push_back(instance(1, "fountain", at({0, 0, 9})));
    const Atlas anew = *build_atlas(more, settings);
    EXPECT_GT(moved(before, anew, numbers(20)), 0u);
    settings.previous = &previous;
    const Atlas after = *build_atlas(more, settings);
    EXPECT_EQ(moved(before, after, numbers(20)), 0u);
    EXPECT_EQ(after.statistics.kept_charts, before.placements.size());
    EXPECT_EQ(after.width, before.width);
    EXPECT_GE(after.height, before.height);
  }
}

TEST(PreviousLayout, AnObjectLessMovesNothing) {
  const Scene scene = street();
  AtlasSettings settings = pack_at(6);
  const Atlas before = *build_atlas(scene, settings);
  const PreviousLayout previous = previous_layout_of(scene, before);
  settings.previous = &previous;
  for (uint32_t gone : {0u, 7u, 19u}) {  // 7: one of several of its name
    Scene less = scene;
    less.instances.erase(less.instances.begin() + gone);
    for (uint32_t i = gone; i < 19; ++i) --less.instances[i].node;
    const Atlas after = *build_atlas(less, settings);
    EXPECT_EQ(moved(before, after, numbers(20, gone)), 0u) << gone;
    EXPECT_EQ(after.width, before.width);
    EXPECT_EQ(after.height, before.height);
  }
}

TEST(PreviousLayout, TheSameSceneIsLaidOutTheSame) {
  const Scene scene = street();
  AtlasSettings settings = pack_at(6);
  const Atlas before = *build_atlas(scene, settings);
  const PreviousLayout previous = previous_layout_of(scene, before);
  settings.previous = &previous;
  EXPECT_EQ(write_atlas(before), write_atlas(*build_atlas(scene, settings)));
}

TEST(PreviousLayout, WhatChangedIsPlacedAnewAndTheRestStays) {
  const Scene scene = street();
  AtlasSettings settings = pack_at(6);
  const Atlas before = *build_atlas(scene, settings);
  const PreviousLayout previous = previous_layout_of(scene, before);
  settings.previous = &previous;
  settings.density.assign(20, 1);
  settings.density[4] = 2;
  const Atlas after = *build_atlas(scene, settings);
  const uint32_t charts = after.of_instance(4).chart_count;
  EXPECT_EQ(after.statistics.kept_charts, before.placements.size() - charts);
  EXPECT_EQ(moved(before, after, numbers(4)), 0u);
}

TEST(PreviousLayout, OneOfAnotherSceneChangesNothing) {
  const Scene scene = street();
  AtlasSettings settings = pack_at(6);
  const Atlas anew = *build_atlas(scene, settings);
  const Scene other = scene_of({sphere(9, 2)});
  const PreviousLayout previous = previous_layout_of(other, *build_atlas(other, settings));
  settings.previous = &previous;
  EXPECT_EQ(write_atlas(anew), write_atlas(*build_atlas(scene, settings)));
}

}  // namespace
}  // namespace kiln
