// Errors drawn of a cache reach a texel along the paths that end there, as the light does.
#include <cmath>
#include <limits>

#include "common/responses/basis.h"
#include "tests/analytic/scene_maker.h"
#include "tests/cache/cached_bake.h"
#include "tests/equivalence/random_scenes.h"
#include "worker/integrators/integrator.h"

namespace kiln {
namespace {

using test::CachedBake;

constexpr uint32_t kSamples = 64;

TransportSettings drawing() {
  TransportSettings s;
  s.quantities.cache_draws = true;
  return s;
}

// A cache that is brighter by what was drawn makes the light brighter by what arrives of it, whatever the
// paths.
TEST(CacheDraws, ArriveAsTheLightDoes) {
  constexpr float kBase = 2, kDrawn[kCacheDraws] = {0.5f, -0.25f, 1, 0};
  for (const uint32_t features : {0u, uint32_t{kLayers}, uint32_t{kLocalLights | kGlass | kLayers}}) {
    const CachedBake b(test::scene_of(features), 8, drawing());
    IrradianceCache cache = test::uniform_cache(b.sites(), Vec3(kBase));
    cache.draws.resize(b.sites());
    for (CacheDraws& d : cache.draws)
      for (size_t k = 0; k < kCacheDraws; ++k) d.set(k, kDrawn[k]);
    const auto drawn = b.run(0, kSamples, &cache);
    ASSERT_TRUE(drawn);
    const size_t first = MomentLayout(drawing().basis, drawing().quantities).cache_draws();
    double arrived = 0;
    for (size_t k = 0; k < kCacheDraws; ++k) {
      const IrradianceCache brighter = test::uniform_cache(b.sites(), Vec3(kBase + kDrawn[k]));
      const auto light = b.run(0, kSamples, &brighter);
      ASSERT_TRUE(light);
      for (size_t s = 0; s < b.sites(); ++s) {
        const double* with = &light->moments[s * light->plane_count];
        const double* own = &drawn->moments[s * drawn->plane_count];
        // Sums of floats, each rounded.
        ASSERT_NEAR(own[first + k], with[kMomentLum] - own[kMomentLum],
                    0x1p-20 * kSamples + 0x1p-20 * std::abs(own[kMomentLum]))
            << features << ", site " << s << ", draw " << k;
        arrived += std::abs(own[first + k]);
      }
    }
    EXPECT_GT(arrived, 0) << features;
  }
}

TEST(CacheDraws, NoneOfWholePathsAndOfACacheWithoutThem) {
  const CachedBake b(test::scene_of(kLayers), 8, drawing());
  const size_t first = MomentLayout(drawing().basis, drawing().quantities).cache_draws();
  const IrradianceCache without = test::uniform_cache(b.sites(), Vec3(2));
  for (const IrradianceCache* cache : {static_cast<const IrradianceCache*>(nullptr), &without}) {
    const auto result = b.run(0, 4, cache);
    ASSERT_TRUE(result);
    for (size_t s = 0; s < b.sites(); ++s)
      for (size_t k = 0; k < kCacheDraws; ++k)
        ASSERT_EQ(result->moments[s * result->plane_count + first + k], 0);
  }
}

TEST(CacheDraws, AreReadBackOrRefused) {
  IrradianceCache cache{std::vector<Vec3>(3, Vec3(1)), std::vector<CacheDraws>(3)};
  cache.draws[1].set(2, 1.0f + 0x1p-8f);                           // halfway: to the larger
  cache.draws[1].set(3, -std::numeric_limits<float>::infinity());  // to the largest
  const auto back = read_irradiance_cache(write_irradiance_cache(cache), 3);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->draws[1][2], 1.0f + 0x1p-7f);
  EXPECT_TRUE(std::isfinite(back->draws[1][3]) && back->draws[1][3] < -3e38f);
  cache.draws[2].bits[0] = 0x7fc0;
  EXPECT_FALSE(read_irradiance_cache(write_irradiance_cache(cache), 3));
  cache.draws.pop_back();
  EXPECT_FALSE(read_irradiance_cache(write_irradiance_cache(cache), 3));
}

}  // namespace
}  // namespace kiln
