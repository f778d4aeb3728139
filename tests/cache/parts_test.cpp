// Sums of light of their own: direct light (--split), and all light for the caches of scenes with lights that
// texels are lit by in reflections alone (`bake: indirect`).
#include <cmath>

#include "tests/analytic/scene_maker.h"
#include "tests/cache/cached_bake.h"
#include "tests/equivalence/random_scenes.h"
#include "worker/bake/film.h"

namespace kiln {
namespace {

using test::CachedBake;
using test::MeanE;
using test::SceneMaker;

constexpr uint32_t kSamples = 32;
// Sums of the same samples, whose parts are rounded to float apart from each other.
constexpr double kRounding = 1e-5;

// Largest difference of three planes, relative to the largest value of `a`.
double difference(const UnitResult& a, size_t plane_a, const UnitResult& b, size_t plane_b) {
  double largest = 0, worst = 0;
  for (size_t s = 0; s < a.site_count; ++s)
    for (size_t c = 0; c < 3; ++c) {
      const double x = a.moments[s * a.plane_count + plane_a + c],
                   y = b.moments[s * b.plane_count + plane_b + c];
      largest = std::max(largest, std::abs(x));
      worst = std::max(worst, std::abs(x - y));
    }
  EXPECT_GT(largest, 0);
  return worst / largest;
}

TransportSettings with(bool direct_apart, bool all_light) {
  TransportSettings s;
  s.quantities.direct_apart = direct_apart;
  s.quantities.all_light = all_light;
  return s;
}

Scene without_hidden_lights(Scene scene) {
  for (Record& light : scene.lights)
    std::erase_if(light.properties, [](const Property& p) { return p.name == "bake"; });
  return scene;
}

Scene with_all_lights_hidden(Scene scene) {
  scene = without_hidden_lights(std::move(scene));
  for (Record& light : scene.lights) light.properties.push_back({"bake", {}, "indirect", {}});
  return scene;
}

// Every kind of emitter, behind every kind of surface.
const uint32_t kFeatureSets[] = {kAllFeatures & ~kOneStrategy, kLocalLights | kSuns, kSkyImage | kLayers,
                                 kLocalLights | kAreaLights | kGlass | kLayers, 0};

TEST(Parts, DirectLightIsWhatABakeOfDirectLightFinds) {
  for (const uint32_t features : kFeatureSets) {
    const Scene scene = test::scene_of(features);
    TransportSettings alone;
    alone.indirect = false;
    const TransportSettings apart = with(true, false);
    const UnitResult whole = *CachedBake(scene, 3, {}).run(0, kSamples),
                     direct = *CachedBake(scene, 3, alone).run(0, kSamples),
                     both = *CachedBake(scene, 3, apart).run(0, kSamples);
    const size_t plane = MomentLayout(apart.basis, apart.quantities).direct();
    EXPECT_LT(difference(whole, kMomentER, both, kMomentER), kRounding) << features;
    EXPECT_LT(difference(direct, kMomentER, both, plane), kRounding) << features;
    EXPECT_GT(difference(whole, kMomentER, both, plane), 0.01) << features;  // it is not all of it
  }
}

TEST(Parts, AllLightIsThatOfLightsThatAreNotHidden) {
  const TransportSettings all = with(false, true), two = with(true, true);
  for (const uint32_t features : kFeatureSets) {
    const Scene hidden = with_all_lights_hidden(test::scene_of(features)),
                full = without_hidden_lights(test::scene_of(features));
    const UnitResult stored = *CachedBake(hidden, 3, {}).run(0, kSamples),
                     lit = *CachedBake(full, 3, {}).run(0, kSamples),
                     both = *CachedBake(hidden, 3, all).run(0, kSamples),
                     three = *CachedBake(hidden, 3, two).run(0, kSamples);
    const MomentLayout layout(all.basis, all.quantities), of_two(two.basis, two.quantities);
    EXPECT_LT(difference(stored, kMomentER, both, kMomentER), kRounding) << features;
    EXPECT_LT(difference(lit, kMomentER, both, layout.all_light()), kRounding) << features;
    EXPECT_GT(difference(lit, kMomentER, both, kMomentER), 0.01) << features;
    EXPECT_LT(difference(stored, kMomentER, three, kMomentER), kRounding) << features;
    EXPECT_LT(difference(lit, kMomentER, three, of_two.all_light()), kRounding) << features;
  }
}

// E and the hidden lights' are floats; together they are not. A worker sends no infinity.
TEST(Parts, SumsThatOverflowTogetherAreDroppedAndCounted) {
  const TransportSettings settings = with(false, true);
  const MomentLayout layout(settings.basis, settings.quantities);
  Film film(layout, settings.response);
  RadianceSamples s;
  s.add({0, 1, 0}, Vec3(2e38f), Arriving::kDirect);
  s.add({0, 1, 0}, Vec3(3e38f), Arriving::kHidden);
  EXPECT_FALSE(film.add(s, {0, 1, 0}));
  for (const double sum : film.sums()) EXPECT_TRUE(std::isfinite(sum));
}

// A closed room under a lamp that texels do not see: what they get has been reflected once at least.
TEST(Parts, CachesOfAllLightFindTheLightOfWholePaths) {
  SceneMaker m;
  m.box({0, 0, 0}, {3, 2, 2.5f}, true, m.lambert(Vec3(0.6f)));
  m.box({1, 0, 1}, {1.6f, 0.8f, 1.5f}, false, m.metallic_roughness(Vec3(0.5f), 0, 1));
  m.point({2, 1.6f, 0.7f}, Vec3(3.0f));
  m.rectangle({1.2f, 1.8f, 1.2f}, {1, 0, 0}, {0, 0, 1}, {0.6f, 0.4f}, Vec3(4.0f));
  const Scene scene = with_all_lights_hidden(m.take());
  const TransportSettings settings = with(false, true);
  const CachedBake b(scene, 5, settings);
  constexpr uint32_t kForCache = 1024, kRead = 1024;
  const UnitResult first = *b.run(0, kForCache), whole = *b.run(kForCache, kRead);
  const size_t all = MomentLayout(settings.basis, settings.quantities).all_light();
  IrradianceCache cache = test::cache_of(first, kForCache), stored = cache;
  for (size_t s = 0; s < b.sites(); ++s)
    if (cache.irradiance[s].x >= 0)
      for (int c = 0; c < 3; ++c)
        cache.irradiance[s][c] = static_cast<float>(
            first.moments[s * first.plane_count + all + static_cast<size_t>(c)] / kForCache);
  const MeanE of_whole = test::mean_e(whole, kRead), read = test::mean_e(*b.run(0, kRead, &cache, 1), kRead),
              short_of = test::mean_e(*b.run(0, kRead, &stored, 1), kRead),
              own = test::mean_e(first, kForCache);
  const double error =
      std::sqrt(of_whole.error * of_whole.error + read.error * read.error + own.error * own.error);
  std::printf("hidden lamps: %+.3f +- %.3f %%\n", 100 * (read.value / of_whole.value - 1),
              100 * error / of_whole.value);
  EXPECT_LT(error, 0.0025 * of_whole.value);
  EXPECT_NEAR(read.value, of_whole.value, 0.002 * of_whole.value + 4 * error);
  // What the test would see: a cache of what is stored lacks the lamps' light on the surfaces that reflect
  // it.
  EXPECT_LT(short_of.value, 0.8 * of_whole.value);
}

}  // namespace
}  // namespace kiln
