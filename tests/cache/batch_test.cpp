// Texels of few samples share a batch: what each gets is what it would get alone, bit for bit.
#include "tests/analytic/scene_maker.h"
#include "tests/cache/cached_bake.h"

namespace kiln {
namespace {

// A lamp, boxes, and a box that stands in a wall, so that some samples begin inside geometry.
Scene buried_box() {
  test::SceneMaker maker;
  const uint32_t grey = maker.lambert(Vec3(0.6f));
  maker.box({0, 0, 0}, {3, 2, 3}, true, grey);
  maker.box({-0.4f, 0, 1}, {0.8f, 0.9f, 2}, false, grey);
  maker.quad({1, 1.9f, 1}, {1, 0, 0}, {0, 0, 1}, maker.lambert(Vec3(0.0f), Vec3(5)));
  return maker.take();
}

TEST(Batches, TexelsDoNotKnowOfEachOther) {
  AtlasSettings layout;
  layout.layout = AtlasSettings::Layout::kPack;
  layout.texels_per_metre = 4;
  layout.cut_contacts = false;
  const Scene scene = buried_box();
  const Atlas atlas = build_atlas(scene, layout).value();
  for (const Sampler sampler : {Sampler::kOwen, Sampler::kHalton}) {
    TransportSettings settings;
    settings.sampler = sampler;
    const auto baker = Baker::create(scene, atlas, settings, 1).value();
    for (const uint32_t samples : {1u, 3u, 16u, 40u}) {
      WorkUnit all;
      all.sample_count = samples;
      all.first_sample = 5;
      for (uint32_t i = 0; i < atlas.sites.size(); ++i) all.sites.push_back(i);
      const UnitResult together = baker->bake(all).value();
      uint64_t rays = 0;
      for (uint32_t i = 0; i < atlas.sites.size(); ++i) {
        WorkUnit one = all;
        one.sites = {i};
        const UnitResult alone = baker->bake(one).value();
        rays += alone.rays;
        for (size_t p = 0; p < alone.plane_count; ++p)
          ASSERT_EQ(together.moments[i * alone.plane_count + p], alone.moments[p]) << i << ", plane " << p;
      }
      EXPECT_GE(together.rays, rays);  // what units found to lie inside is not asked again
    }
  }
}

}  // namespace
}  // namespace kiln
