#include <numeric>

#include "coordinator/bake/denoise/coarse.h"
#include "coordinator/bake/neighbours/views.h"
#include "tests/analytic/scene_maker.h"
#include "tests/denoise/fields.h"

namespace kiln {
namespace {

using namespace test;

Denoised joined(const MadeSurface& on, const TexelStatistics& s, uint32_t levels, unsigned threads = 2) {
  return denoise_joined(s, kBounds, on.sites, on.links, levels, threads);
}

void set_samples(TexelStatistics& s, uint32_t samples) {
  for (size_t i = 0; i < s.sites; ++i) {
    s.variance[i] *= static_cast<float>(samples) / static_cast<float>(s.samples[i]);
    s.samples[i] = samples;
  }
}

TEST(Joined, KeepsAConstantField) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  const TexelStatistics s = noisy(wall.sites, constant(3), kNone, 1);
  for (const uint32_t levels : {1u, 2u, 3u}) {
    const Denoised d = joined(wall, s, levels);
    for (size_t i = 0; i < s.sites; ++i) ASSERT_NEAR(d.luminance[i], 3 * kShare, 1e-5) << levels << ' ' << i;
  }
}

// Filters chosen for the errors of a pass serve the planes of the finished map, and no other statistics.
TEST(Joined, FiltersServeOnceMore) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  const TexelStatistics s = noisy(
      wall.sites, [](const Vec3& p) { return 2 + std::sin(p.x); }, constant(0.3), 8);
  const auto with = [&](const TexelStatistics& of, uint32_t levels, KeptFilters& filters) {
    return denoise_joined(of, kBounds, wall.sites, wall.links, levels, 2, &filters);
  };
  std::vector<TexelStatistics> others(6, s);
  others[0].luminance[1][7] *= 1.5f;
  others[1].variance[7] *= 1.5f;
  others[2].samples[7] += 1;
  others[3].known[7] = 0;
  others[4].shared.assign(s.sites, 0.01f);
  others[5].luminance[0][7] *= 1.5f;
  for (uint32_t levels = 0; levels < 3; ++levels) {
    KeptFilters filters;
    denoise_joined_luminance(s, wall.sites, wall.links, levels, 2, &filters);
    const KeptFilters of_pass = filters;
    const Denoised of_map = with(s, levels, filters), anew = joined(wall, s, levels);
    EXPECT_EQ(filters, of_pass) << "none are chosen again";
    EXPECT_EQ(of_map.mean, anew.mean);
    EXPECT_EQ(of_map.standard_error, anew.standard_error);
    for (const TexelStatistics& other : others) {
      KeptFilters of_others = of_pass;
      const Denoised found = with(other, levels, of_others), expected = joined(wall, other, levels);
      EXPECT_EQ(found.mean, expected.mean);
      EXPECT_EQ(found.standard_error, expected.standard_error);
    }
  }
}

// One texel is darker than those around it and has a hundred times their samples: their noise does not hide
// it.
TEST(Joined, ATexelWithManyTimesTheSamplesStaysAlone) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  const size_t one = wall.sites.size() / 2;
  const auto is_one = [&](const Vec3& p) { return p == wall.sites.position[one]; };
  TexelStatistics s = noisy(
      wall.sites, [&](const Vec3& p) { return is_one(p) ? 2.0 : 3.0; },
      [&](const Vec3& p) { return is_one(p) ? 0.001 : 1.0; }, 3);
  set_samples(s, 8);
  TexelStatistics ahead = s;
  ahead.samples[one] = 800;
  for (const uint32_t levels : {1u, 2u}) {
    EXPECT_GT(joined(wall, s, levels).luminance[one], 2.5 * kShare) << levels;
    const Denoised d = joined(wall, ahead, levels);
    EXPECT_NEAR(d.luminance[one], 2 * kShare, 2 * d.standard_error[one]) << levels;
    // Of independent samples with the noise around: 16 a sample, and 2 x 800 samples.
    EXPECT_LT(d.standard_error[one], std::sqrt(16.0 / 1600) * kShare) << levels;
  }
}

// Many times as many as next to none are still too few to stand alone.
TEST(Joined, ATexelWithFewSamplesIsJoinedWhateverTheOthersHave) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  const size_t one = wall.sites.size() / 2;
  TexelStatistics few = noisy(wall.sites, constant(3), constant(1), 3);
  set_samples(few, 2);
  few.samples[one] = 24;
  const TexelStatistics own = few;
  few.samples[one] = 2;
  for (const uint32_t levels : {1u, 2u}) {
    const float alone = joined(wall, own, levels).strength[one],
                with = joined(wall, few, levels).strength[one];
    EXPECT_EQ(alone, with) << levels << ": as much of its light comes from its neighbours";
    EXPECT_GT(with, 0.5f) << levels;
  }
}

// Noise in one piece of surface: joined texels reach further, so that less of it is left, and the light of
// all together is what was measured.
TEST(Joined, ReachesFurtherAndKeepsTheLight) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  double left[3] = {};
  for (uint64_t seed = 0; seed < 6; ++seed) {
    TexelStatistics s = noisy(wall.sites, constant(1), constant(1), seed);
    set_samples(s, 1);
    for (uint32_t levels = 0; levels < 3; ++levels) {
      const Denoised d = joined(wall, s, levels);
      left[levels] += squares(wall.sites, s, d, constant(1)).denoised;
      EXPECT_NEAR(sum_of(d.luminance), sum_of_measured(s), 1e-5 * sum_of_measured(s)) << levels;
    }
  }
  EXPECT_LT(left[1], 0.7 * left[0]);
  EXPECT_LT(left[2], 0.7 * left[1]);
}

// A step of many times the noise stays, and its texels with it.
TEST(Joined, KeepsSteps) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  const Field edge = [](const Vec3& p) { return 1 + (p.x + 0.3 * p.y > 4 ? 4.0 : 0.0); };
  const TexelStatistics s = noisy(wall.sites, edge, constant(0.1), 5);
  const Squares q = squares(wall.sites, s, joined(wall, s, 2), edge);
  EXPECT_LT(q.denoised, q.raw);
}

TEST(Joined, StatesItsErrorOnSmoothFields) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  const Field wave = [](const Vec3& p) { return 3 + std::sin(1.5 * p.x) + std::cos(1.1 * p.y); };
  for (const double noise : {0.2, 0.6, 2.0}) {
    Squares all;
    for (uint64_t seed = 0; seed < 6; ++seed) {
      const TexelStatistics s = noisy(wall.sites, wave, constant(noise), 10 + seed);
      const Squares q = squares(wall.sites, s, joined(wall, s, 2), wave);
      all.raw += q.raw, all.denoised += q.denoised, all.ratio += q.ratio, all.sites += q.sites;
    }
    EXPECT_LT(all.denoised, all.raw / 4) << noise;
    EXPECT_LT(all.ratio / all.sites, 1.25) << noise;
  }
}

TEST(Joined, StatesWhatTexelsShareByWayOfCaches) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  TexelStatistics s = noisy(wall.sites, constant(3), kNone, 1);
  s.shared.assign(s.sites, 0.01f);
  for (const uint32_t levels : {1u, 2u}) {
    const Denoised d = joined(wall, s, levels);
    for (size_t i = 0; i < s.sites; ++i)
      ASSERT_NEAR(d.standard_error[i], std::sqrt(8.0 / 9 * 0.01) * 3 * kShare, 1e-3) << levels;
  }
}

TEST(Joined, FillsTexelsWithoutSamples) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  TexelStatistics s = noisy(wall.sites, constant(2), kNone, 1);
  for (size_t i = 0; i < s.sites; ++i)
    if (wall.sites.texel[i][0] % 4 || wall.sites.texel[i][1] % 4) {
      s.known[i] = 0;
      s.samples[i] = 0;
      for (uint32_t r = 0; r < kReplicates; ++r) {
        s.luminance[r][i] = 0;
        std::fill_n(&s.mean[r][15 * i], 15, 0.0f);
      }
    }
  const Denoised d = joined(wall, s, 2);
  size_t filled = 0;
  for (size_t i = 0; i < s.sites; ++i) {
    if (!d.filled[i]) continue;
    ++filled;
    ASSERT_NEAR(d.luminance[i], 2 * kShare, 1e-4) << i;
    ASSERT_NEAR(d.mean[15 * i], 2, 1e-4) << i;
  }
  EXPECT_GT(filled, s.sites * 8 / 10);
}

TEST(Joined, WhatIsNoNumberSpoilsNoOther) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  TexelStatistics s = noisy(wall.sites, constant(2), constant(0.1), 1);
  const size_t bad = s.sites / 2;
  s.luminance[0][bad] = std::numeric_limits<float>::infinity();
  s.mean[0][15 * bad] = std::numeric_limits<float>::infinity();
  const Denoised d = joined(wall, s, 2);
  for (size_t i = 0; i < s.sites; ++i) {
    if (i == bad) continue;
    ASSERT_TRUE(std::isfinite(d.luminance[i]) && std::isfinite(d.standard_error[i])) << i;
    for (size_t p = 0; p < 15; ++p) ASSERT_TRUE(std::isfinite(d.mean[15 * i + p])) << i;
  }
  EXPECT_TRUE(std::isinf(d.standard_error[bad]));
}

TEST(Joined, IsTheSameForAnyNumberOfThreads) {
  const MadeSurface wall(wall_of_eight().scene, 8);
  const TexelStatistics s = noisy(
      wall.sites, [](const Vec3& p) { return 2 + std::sin(p.x); }, constant(0.3), 8);
  const Denoised one = joined(wall, s, 2, 1), three = joined(wall, s, 2, 3);
  EXPECT_EQ(one.mean, three.mean);
  EXPECT_EQ(one.standard_error, three.standard_error);
  const Denoised plain = denoise_joined_luminance(s, wall.sites, wall.links, 2, 2);
  EXPECT_EQ(one.luminance, plain.luminance);
  EXPECT_EQ(one.standard_error, plain.standard_error);
}

TEST(Joined, LevelsFollowSamples) {
  const MadeSurface wall(wall_of_eight().scene, 6);
  TexelStatistics s = noisy(wall.sites, constant(1), constant(0.1), 1);
  const std::pair<uint32_t, uint32_t> expected[] = {{1, 2}, {8, 2}, {16, 1}, {24, 1}, {32, 0}, {64, 0}};
  for (const auto& [samples, levels] : expected) {
    set_samples(s, samples);
    EXPECT_EQ(denoise_levels(s), levels) << samples;
  }
}

// A floor of which a part lies inside a crate that hovers four centimetres above it, so that there is no line
// of contact: what is inside sees the crate's walls from within.
TEST(Views, PartWhatIsInsideThingsFromWhatIsBeside) {
  SceneMaker maker;
  const uint32_t grey = maker.lambert(Vec3(0.5f));
  maker.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, grey);
  maker.box({1.06f, 0.04f, 1.06f}, {2.94f, 1, 2.94f}, false, grey);
  MadeSurface floor(maker.take(), 8);
  const SurfaceLinks before = floor.links;
  ASSERT_TRUE(link_by_view(floor.scene, floor.sites, 2, 1e9, floor.links));
  const auto inside = [&](size_t i) {  // metres from the crate's outline; of other surfaces than the floor: 0
    const Vec3& p = floor.sites.position[i];
    return p.y > 0.01f ? 0.0f : std::min({p.x - 1.06f, 2.94f - p.x, p.z - 1.06f, 2.94f - p.z});
  };
  size_t crossing = 0, parted = 0, far = 0;
  for (uint32_t i = 0; i < floor.sites.size(); ++i) {
    if (inside(i) > 0.3f) {
      ++far;
      ASSERT_EQ(before.of(i).size(), floor.links.of(i).size()) << i;
    }
    for (const uint32_t j : before.of(i)) {
      if (!(inside(i) > 0 && inside(j) < 0)) continue;
      ++crossing;
      const std::span<const uint32_t> left = floor.links.of(i);
      parted += std::find(left.begin(), left.end(), j) == left.end();
    }
  }
  EXPECT_GT(far, 50u);
  EXPECT_GT(crossing, 30u);
  EXPECT_GT(parted, crossing / 2) << crossing;
}

TEST(Views, AreTheSameForAnyNumberOfThreadsAndKeepAllLinksOutOfTime) {
  MadeSurface one(wall_of_eight().scene, 8), three = one;
  const std::vector<uint32_t> links = one.links.link;
  EXPECT_FALSE(link_by_view(one.scene, one.sites, 1, 0, one.links));
  EXPECT_EQ(one.links.link, links);
  link_by_view(one.scene, one.sites, 1, 1e9, one.links);
  link_by_view(three.scene, three.sites, 3, 1e9, three.links);
  EXPECT_EQ(one.links.link, three.links.link);
  EXPECT_EQ(one.links.first, three.links.first);
}

}  // namespace
}  // namespace kiln
