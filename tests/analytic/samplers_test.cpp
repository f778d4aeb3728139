// Every sampler measures the same light, with other numbers.
#include "common/math/samplers.h"

#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

// A floor under a lamp and a slab that shades it, in a closed box: site, direction, light and bounces all
// count. Means over the floor differ by no more than four of their own standard errors.
TEST(Samplers, AllMeasureTheSame) {
  test::SceneMaker m;
  const uint32_t grey = m.lambert(Vec3(0.5f)), lamp = m.lambert(Vec3(0.0f), Vec3(4.0f));
  m.quad({0, 0, 0}, {0, 0, 2}, {2, 0, 0}, grey);
  m.box({-0.01f, -0.01f, -0.01f}, {2.01f, 2, 2.01f}, true, grey);
  m.quad({0.7f, 1.9f, 0.7f}, {0.6f, 0, 0}, {0, 0, 0.6f}, lamp);
  m.box({0.8f, 0.5f, 0.8f}, {1.2f, 0.6f, 1.2f}, false, grey);
  const Scene scene = m.take();
  double mean[kSamplers], error[kSamplers];
  for (uint32_t s = 0; s < kSamplers; ++s) {
    TransportSettings settings;
    settings.sampler = static_cast<Sampler>(s);
    const test::Bake b = test::bake(scene, 4, 512, settings, 0);
    mean[s] = error[s] = 0;
    for (const test::BakedTexel& t : b.texels) {
      mean[s] += t.luminance / static_cast<double>(b.texels.size());
      error[s] += t.standard_error * t.standard_error;
    }
    error[s] = std::sqrt(error[s]) / static_cast<double>(b.texels.size());
    EXPECT_GT(mean[s], 0.1);
    EXPECT_LT(error[s], 0.02 * mean[s]);
    for (uint32_t other = 0; other < s; ++other) {
      EXPECT_NE(mean[s], mean[other]);
      EXPECT_NEAR(mean[s], mean[other], 4 * std::hypot(error[s], error[other]))
          << sampler_names()[s] << " " << sampler_names()[other];
    }
  }
}

}  // namespace
}  // namespace kiln
