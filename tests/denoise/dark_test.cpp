#include "coordinator/bake/denoise/dark.h"

#include <gtest/gtest.h>

#include "coordinator/bake/denoise/candidates.h"
#include "coordinator/bake/denoise/coarse.h"
#include "tests/denoise/fields.h"

namespace kiln {
namespace {

using namespace test;

// Light that one sample of a texel meets with the probability `lit` and that is 1 / lit then: each replicate
// has the mean of so many.
TexelStatistics rare(const SiteGeometry& sites, const Field& field, double lit, uint32_t samples,
                     uint64_t seed) {
  TexelStatistics s = noisy(sites, kNone, kNone, seed);
  std::mt19937_64 random(seed);
  std::binomial_distribution<uint32_t> met(samples, lit);
  for (size_t i = 0; i < s.sites; ++i) {
    const double light = field(sites.position[i]);
    s.samples[i] = samples;
    s.variance[i] = static_cast<float>(light * light * kShare * kShare * (1 - lit) / lit);
    for (uint32_t r = 0; r < kReplicates; ++r) {
      const auto mean = static_cast<float>(light * met(random) / (lit * samples));
      float* plane = &s.mean[r][i * s.planes];
      for (int c = 0; c < 3; ++c) plane[c] = plane[3 + c] = std::ldexp(mean, -c);
      s.luminance[r][i] = luminance(Vec3(plane[0], plane[1], plane[2]));
    }
  }
  return s;
}

size_t parted(const MadeSurface& on, const TexelStatistics& s) {
  return on.links.link.size() - part_dark(s, on.sites, on.links, 2).link.size();
}

// A board lies on the wall: three texels wide, dark.
bool is_under(const Vec3& p) {
  return p.x > 4 && p.x < 4.4f;
}
const Field kBoard = [](const Vec3& p) { return is_under(p) ? 0.0 : 1.0; };

TEST(Dark, TexelsUnderABoardStayDark) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  for (const uint32_t samples : {1u, 4u, 16u}) {
    const TexelStatistics s = rare(wall.sites, kBoard, 0.9, samples, samples);
    const uint32_t levels = denoise_levels(s);
    const Denoised d = denoise_joined(s, kBounds, wall.sites, wall.links, levels, 2);
    double under = 0, lit = 0, texels_under = 0, texels_lit = 0;
    for (size_t i = 0; i < s.sites; ++i) {
      (is_under(wall.sites.position[i]) ? under : lit) += d.luminance[i] / kShare;
      (is_under(wall.sites.position[i]) ? texels_under : texels_lit) += 1;
    }
    ASSERT_GT(texels_under, 80);
    EXPECT_LT(under / texels_under, 0.02) << samples;
    // 1,800 texels, of which a hundredth is black by chance at one sample a replicate.
    EXPECT_NEAR(lit / texels_lit, 1, 0.01) << samples;
  }
}

TEST(Dark, ASingleTexelStaysDarkInSteadyLight) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  TexelStatistics s = rare(wall.sites, constant(1), 0.999, 4, 7);
  const size_t one = s.sites / 2;
  s.luminance[0][one] = s.luminance[1][one] = 0;
  for (uint32_t r = 0; r < kReplicates; ++r) std::fill_n(&s.mean[r][one * s.planes], s.planes, 0.0f);
  const SurfaceLinks links = part_dark(s, wall.sites, wall.links, 2);
  EXPECT_EQ(links.of(static_cast<uint32_t>(one)).size(), 0u);
  EXPECT_GT(links.link.size(), wall.links.link.size() - 16);
}

// Where samples seldom meet light, most texels are dark by chance: no link goes, and no light is lost.
TEST(Dark, ChanceIsNotTakenForDarkness) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  for (const double lit : {0.02, 0.1, 0.3, 0.6})
    for (const uint32_t samples : {1u, 4u}) {
      const TexelStatistics s = rare(wall.sites, constant(1), lit, samples, 11);
      // One dark texel of a cluster has up to four; a tenth of those called dark are false
      // where some are true, and none is true here.
      EXPECT_LT(parted(wall, s), wall.links.link.size() / 100) << lit << ' ' << samples;
    }
}

// Samples vary by as much as their mean. Both replicates of a texel are black: of one sample each, by chance
// perhaps; of 32, not. Another texel has met a little light, so that it is not found to be dark.
TEST(Dark, ATexelThatItsSamplesShowToBeDarkTakesNoNoiseOfBrightOnes) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  for (const uint32_t samples : {1u, 32u}) {
    TexelStatistics s = rare(wall.sites, constant(1), 0.5, samples, 3);
    const size_t black = s.sites / 2, dim = s.sites / 3;
    for (const size_t i : {black, dim}) s.luminance[0][i] = s.luminance[1][i] = s.variance[i] = 0;
    s.luminance[0][dim] = 1e-3f;
    const Candidates c = find_candidates(s, wall.sites, wall.links, 2);
    for (const size_t i : {black, dim}) {
      const double stated = std::sqrt(double{c.prior[i]}) * c.scale,
                   of_bright = kShare / std::sqrt(kReplicates * samples);
      if (samples == 1) EXPECT_GT(stated, 0.5 * of_bright);
      if (samples == 32) EXPECT_LT(stated, 0.01 * of_bright);
    }
  }
}

TEST(Dark, AllDarkStaysLinked) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  const TexelStatistics s = rare(wall.sites, constant(0), 0.5, 4, 3);
  EXPECT_EQ(parted(wall, s), 0u);
}

TEST(Dark, TheSameForAnyNumberOfThreads) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  const TexelStatistics s = rare(wall.sites, kBoard, 0.8, 2, 5);
  const SurfaceLinks one = part_dark(s, wall.sites, wall.links, 1),
                     five = part_dark(s, wall.sites, wall.links, 5);
  EXPECT_EQ(one.first, five.first);
  EXPECT_EQ(one.link, five.link);
  EXPECT_LT(one.link.size(), wall.links.link.size());
}

}  // namespace
}  // namespace kiln
