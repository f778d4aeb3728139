#include "coordinator/bake/sampling/first_look.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "coordinator/bake/sampling/texel_errors.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

// A floor and many small boxes on it: charts of thousands of texels and of few.
Atlas floor_and_boxes() {
  test::SceneMaker maker;
  const uint32_t grey = maker.lambert(Vec3(0.5f));
  maker.quad({0, 0, 0}, {0, 0, 6}, {6, 0, 0}, grey);
  for (int i = 0; i < 20; ++i) {
    const float x = 0.2f + 0.28f * static_cast<float>(i), z = 0.3f + 0.21f * static_cast<float>(i * 7 % 20);
    maker.box({x, 1, z}, {x + 0.1f, 1.2f, z + 0.15f}, false, grey);
  }
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = 8;
  return *build_atlas(maker.scene(), settings);
}

TEST(FirstLook, MeetsEveryTexelOnceAndEveryChartFirst) {
  const Atlas atlas = floor_and_boxes();
  const auto looks = sites_by_look(atlas);
  ASSERT_EQ(looks.size(), 4u);
  std::vector<uint32_t> count(atlas.sites.size());
  for (const auto& look : looks)
    for (const uint32_t site : look) ++count[site];
  for (const uint32_t c : count) ASSERT_EQ(c, 1u);
  std::vector<uint8_t> met(atlas.placements.size() + 1);
  for (const uint32_t site : looks[0]) met[atlas.owner[atlas.sites.texel[site]]] = 1;
  for (const uint32_t texel : atlas.sites.texel) ASSERT_TRUE(met[atlas.owner[texel]]) << texel;
  // One in 64 of the floor's 2,300 texels, and one of each of 120 faces.
  EXPECT_LT(looks[0].size(), atlas.sites.size() / 64 + 121);
  EXPECT_LT(looks[0].size() + looks[1].size(), atlas.sites.size() / 16 + 121);
}

TEST(FirstLook, AStrideKeepsOneTexelOfEveryChart) {
  const Atlas atlas = floor_and_boxes();
  std::vector<SiteSamples> work;
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) work.push_back({site, {0, 4}});
  keep_stride(atlas, 2, work);
  std::vector<uint8_t> kept(atlas.placements.size() + 1);
  size_t beside = 0;
  for (const SiteSamples& s : work) {
    const uint32_t texel = atlas.sites.texel[s.site];
    if (texel % atlas.width % 2 || texel / atlas.width % atlas.height % 2) {
      EXPECT_FALSE(kept[atlas.owner[texel]]) << "one is enough";
      ++beside;
    }
    kept[atlas.owner[texel]] = 1;
  }
  for (const uint32_t texel : atlas.sites.texel) ASSERT_TRUE(kept[atlas.owner[texel]]) << texel;
  EXPECT_GT(beside, 0u) << "of charts of one or two texels";
  EXPECT_LT(work.size(), atlas.sites.size() / 4 + 121);
  EXPECT_GT(4 * work.size(), atlas.sites.size());
  EXPECT_TRUE(std::is_sorted(work.begin(), work.end(),
                             [](const SiteSamples& a, const SiteSamples& b) { return a.site < b.site; }));
}

// What is between the texels of a look has what they say, and nothing of another chart.
TEST(FirstLook, FillsBetweenWithinCharts) {
  const Atlas atlas = floor_and_boxes();
  const std::vector<uint32_t> charts = charts_of_sites(atlas);
  const auto looks = sites_by_look(atlas);
  std::vector<uint8_t> sampled(atlas.sites.size());
  IrradianceCache cache;
  cache.irradiance.assign(atlas.sites.size(), Vec3(-1.0f));
  cache.draws.resize(atlas.sites.size());
  const auto light = [&](size_t site) { return static_cast<float>(charts[site]) + 1; };
  for (size_t done = 1; done <= 2; ++done) {
    for (const uint32_t site : looks[done - 1]) {
      sampled[site] = 1;
      cache.irradiance[site] = Vec3(light(site));
      cache.draws[site].set(2, -light(site));
    }
    EXPECT_EQ(look_stride(done), done == 1 ? 8u : 4u);
    IrradianceCache filled = cache;
    fill_between(atlas, charts, sampled, look_stride(done), filled);
    for (size_t site = 0; site < atlas.sites.size(); ++site)
      ASSERT_NEAR(filled.irradiance[site].x, light(site), 1e-4f * light(site)) << site;
    for (size_t site = 0; site < atlas.sites.size(); ++site)  // of 8 bits
      ASSERT_NEAR(filled.draws[site][2], -light(site), 0x1p-8f * light(site)) << site;
  }
}

// A texel that has samples and is not known lies inside geometry: it stays unknown, and speaks for no other.
TEST(FirstLook, LeavesUnknownWhatLiesInside) {
  const Atlas atlas = floor_and_boxes();
  const std::vector<uint32_t> charts = charts_of_sites(atlas);
  std::vector<uint8_t> sampled(atlas.sites.size());
  IrradianceCache cache;
  cache.irradiance.assign(atlas.sites.size(), Vec3(-1.0f));
  const auto looks = sites_by_look(atlas);
  for (const uint32_t site : looks[0]) sampled[site] = 1;
  fill_between(atlas, charts, sampled, 8, cache);
  for (const Vec3& e : cache.irradiance) ASSERT_EQ(e.x, -1.0f);
}

}  // namespace
}  // namespace kiln
