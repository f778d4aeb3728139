#include "common/atlas/site_lookup.h"

#include <cmath>
#include <limits>

#include "common/atlas/site_picker.h"
#include "tests/analytic/scene_maker.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

Atlas layout(const Scene& scene, float texels_per_metre, bool cut, uint32_t max_page_size = 8192) {
  AtlasSettings a;
  a.max_page_size = max_page_size;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = texels_per_metre;
  a.cut_contacts = cut;
  auto atlas = build_atlas(scene, a);
  if (!atlas) throw std::runtime_error(atlas.error().message);
  return std::move(*atlas);
}

// Every point that a site is sampled at is found as that site.
void expect_own_points(const Scene& scene, const Atlas& atlas) {
  const SiteLookup lookup(atlas, scene);
  size_t points = 0, others = 0;
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) {
    SitePicker picker(atlas, site);
    for (uint32_t i = 0; i < picker.count(); ++i, ++points) {
      const SitePick p = picker.at(i);
      others += lookup.find(p.instance, p.triangle, p.b1, p.b2).site != site;
    }
  }
  EXPECT_GT(points, 1000u);
  EXPECT_EQ(others, 0u) << "of " << points;
}

TEST(SiteLookup, FindsTheSiteOfItsOwnPoints) {
  const Scene room = test::small_room();
  for (const float density : {2.0f, 4.0f, 11.3f}) expect_own_points(room, layout(room, density, false));
}

TEST(SiteLookup, FindsThemOnEveryPage) {
  const Scene room = test::small_room();
  const Atlas atlas = layout(room, 4, false, 32);
  ASSERT_GT(atlas.pages, 1u);
  expect_own_points(room, atlas);
}

TEST(SiteLookup, FindsThemWhereChartsAreCut) {
  // Walls that stand on the middle of a floor, one askew: they part its triangles.
  test::SceneMaker m;
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, m.lambert(Vec3(0.5f)));
  m.box({0, 0, 1.9f}, {4, 2, 2.15f}, false);
  m.quad({-0.5f, -0.5f, 3}, {5, 0, 0.4f}, {0, 2, 0});
  const Scene scene = m.take();
  for (const float density : {4.0f, 11.3f}) {
    const Atlas atlas = layout(scene, density, true);
    EXPECT_GT(atlas.statistics.cut_charts, 0u);
    expect_own_points(scene, atlas);
  }
}

TEST(SiteLookup, FindsThemOnCurvedSurfaces) {
  test::SceneMaker m;
  m.sphere({0, 0, 0}, 1, 12, m.lambert(Vec3(0.5f)));
  m.sphere({4, 0, 0}, 1.5f, 9, 0, true);
  const Scene scene = m.take();
  expect_own_points(scene, layout(scene, 8, true));
}

TEST(SiteLookup, KnowsTheSizeOfTexels) {
  test::SceneMaker m;
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, m.lambert(Vec3(0.5f)));
  Scene scene = m.take();
  scene.instances.push_back(scene.instances[0]);
  scene.instances[1].name = "larger";
  scene.instances[1].to_world = Mat4x3(Vec3(3, 0, 0), Vec3(0, 3, 0), Vec3(0, 0, 3), Vec3(0, 5, 0));
  const Atlas atlas = layout(scene, 4, true);
  const SiteLookup lookup(atlas, scene);
  for (uint32_t instance : {0u, 1u})
    EXPECT_NEAR(lookup.find(instance, 0, 0.3f, 0.3f).texel_size, 0.25f, 0.01f);
}

TEST(SiteLookup, WhatIsNoPointHasNoSite) {
  const Scene room = test::small_room();
  const Atlas atlas = layout(room, 4, false);
  const SiteLookup lookup(atlas, room);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(lookup.find(0, 0, nan, 0.2f).site, SiteLookup::kNone);
  EXPECT_EQ(lookup.find(0, 0, 1e30f, 0.2f).site, SiteLookup::kNone);
  EXPECT_EQ(lookup.find(0, 0, -1e30f, 0.2f).site, SiteLookup::kNone);
  // What rays meet may have no place in the atlas.
  EXPECT_EQ(lookup.find(~0u, 0, 0.2f, 0.2f).site, SiteLookup::kNone);
  EXPECT_EQ(lookup.find(0, ~0u, 0.2f, 0.2f).site, SiteLookup::kNone);
}

}  // namespace
}  // namespace kiln
