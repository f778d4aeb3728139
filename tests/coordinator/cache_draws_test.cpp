// What the texels of a room share is the error of the cache at which their paths end. In a room whose texels
// all see all others, and whose light is known, that error is known too; it is stated without looking at it.
#include "coordinator/bake/sampling/cache_draws.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "coordinator/bake/sampling/texel_errors.h"

namespace kiln {
namespace {

constexpr size_t kSites = 120;
constexpr float kLight = 3, kReflected = 0.7f;  // of the light, what comes by way of the cache
constexpr uint32_t kSamples = 4;

struct Room {
  TexelStatistics statistics;
  double shared = 0;  // error of the mean of both replicates, in all texels alike
};

// Whole paths, and then passes whose paths end at the cache of the pass before. `last`: noise of a sample of
// the last pass, over the light.
Room bake(uint32_t passes, std::mt19937& random, double last = 1) {
  const std::vector<uint32_t> one_chart(kSites, 1), samples(kSites, kSamples);
  std::normal_distribution<double> normal;
  Room room;
  IrradianceCache caches[kReplicates];
  for (uint32_t pass = 0; pass < passes; ++pass) {
    TexelStatistics s;
    s.sites = kSites;
    s.samples = samples;
    s.known.assign(kSites, 1);
    s.variance.assign(kSites, 0.0f);
    room.shared = 0;
    for (uint32_t r = 0; r < kReplicates; ++r) {
      s.drawn[r] = ZeroedVector<float>(kSites * kCacheDraws);
      double inherited = 0, drawn[kCacheDraws] = {};
      for (size_t i = 0; pass > 0 && i < kSites; ++i) {
        inherited += kReflected * (double{caches[r].irradiance[i].x} - kLight) / kSites;
        for (size_t k = 0; k < kCacheDraws; ++k)
          drawn[k] += kReflected * double{caches[r].draws[i][k]} / kSites;
      }
      room.shared += inherited / kReplicates;
      for (size_t i = 0; i < kSites; ++i) {
        double sum = 0, squares = 0;
        for (uint32_t n = 0; n < kSamples; ++n) {
          const double noise = pass + 1 == passes ? last : 1,
                       x = kLight * (1 + noise * normal(random)) + inherited;
          sum += x, squares += x * x;
        }
        s.luminance[r].push_back(static_cast<float>(sum / kSamples));
        s.variance[i] += static_cast<float>((squares - sum * sum / kSamples) / (kSamples - 1) / kReplicates);
        for (size_t k = 0; k < kCacheDraws; ++k)
          s.drawn[r][i * kCacheDraws + k] = static_cast<float>(drawn[k]);
      }
    }
    const std::vector<float> noise = independent_variance(s, one_chart);
    for (uint32_t r = 0; r < kReplicates; ++r) {
      caches[r].irradiance.clear();
      caches[r].draws.assign(kSites, {});
      for (size_t i = 0; i < kSites; ++i) {
        caches[r].irradiance.push_back(Vec3(s.luminance[r][i]));
        for (size_t k = 0; k < kCacheDraws; ++k) caches[r].draws[i].set(k, s.drawn[r][i * kCacheDraws + k]);
      }
      add_noise_draws({noise, samples, samples}, static_cast<uint32_t>(random()), caches[r]);
    }
    room.statistics = std::move(s);
  }
  return room;
}

TEST(CacheDraws, StateWhatTexelsShareByWayOfTheCache) {
  std::mt19937 random(7);
  const std::vector<uint32_t> one_chart(kSites, 1);
  for (const uint32_t passes : {2u, 4u}) {
    constexpr int kRooms = 1500;
    double actual = 0, stated = 0, squares = 0;
    for (int k = 0; k < kRooms; ++k) {
      Room room = bake(passes, random);
      find_shared(one_chart, room.statistics);
      const double s = room.statistics.shared[kSites / 2] * kLight * kLight;
      actual += room.shared * room.shared / kRooms;
      stated += s / kRooms;
      squares += s * s / kRooms;
    }
    // Four standard deviations: the mean of n squares of normal numbers scatters by sqrt(2 / n), and there
    // are eight draws in each room to one error. (The light that they are divided by is off by a few per
    // cent.)
    EXPECT_NEAR(stated / actual, 1, 4 * std::sqrt(2.0 / kRooms + 2.0 / (8 * kRooms))) << passes;
    // One draw would scatter by sqrt(2) of its mean, eight do by a half.
    EXPECT_LT(std::sqrt(squares / (stated * stated) - 1), 0.65) << passes;
  }
}

// As on open ground, where few paths end at a cache.
TEST(CacheDraws, TexelsThatDrewNothingCountAmongThoseAlike) {
  // Two, as what one texel alone has drawn is noise: it shares nothing.
  constexpr size_t kRow = 300, kHave[] = {140, 141};
  constexpr float kDraw = 0.25f;
  TexelStatistics s;
  s.sites = kRow;
  s.samples.assign(kRow, kSamples);
  s.known.assign(kRow, 1);
  s.variance.assign(kRow, 0.0f);
  for (uint32_t r = 0; r < kReplicates; ++r) {
    s.luminance[r].assign(kRow, kLight);
    s.drawn[r] = ZeroedVector<float>(kRow * kCacheDraws);
    for (const size_t i : kHave) std::fill_n(&s.drawn[r][i * kCacheDraws], kCacheDraws, kDraw);
  }
  find_shared(std::vector<uint32_t>(kRow, 1), s);
  // Of 129 sites two have drawn: (n (2 d)^2 - n 2 d^2) / (n - 1), of a mean of two replicates.
  constexpr double kAlike = 129, kSquare = double{kDraw} * double{kDraw};
  const double shared =
      kAlike * 2 * kSquare / (kAlike - 1) / kReplicates / std::pow(kAlike * double{kLight}, 2);
  for (const size_t site : {kHave[1] - 64, kHave[0], kHave[0] + 64})
    EXPECT_NEAR(s.shared[site], shared, 1e-6 * shared) << "both are within 64 sites of " << site;
  for (const size_t site : {kHave[0] - 65, kHave[1] + 65}) EXPECT_EQ(s.shared[site], 0.0f) << site;
}

// Where texels have little noise of their own, what they share is all of their error. The replicates'
// difference is one draw of it, so that 1.96 stated deviations hold in 70 % of the rooms (Student's t of one
// degree of freedom); with the draws there are nine, and it is 92 %. `covered(statistics)`: the share of
// texels whose interval holds the truth.
template <class Covered>
void expect_intervals_hold(uint32_t seed, const Covered& covered) {
  std::mt19937 random(seed);
  constexpr int kRooms = 600;
  double with = 0, without = 0;
  for (int k = 0; k < kRooms; ++k) {
    TexelStatistics s = bake(2, random, 0.005).statistics;
    without += covered(s) / kRooms;
    find_shared(std::vector<uint32_t>(kSites, 1), s);
    with += covered(s) / kRooms;
  }
  // Four standard deviations of a share of so many rooms.
  const auto four_sigma = [&](double share) { return 4 * std::sqrt(share * (1 - share) / kRooms); };
  EXPECT_NEAR(with, 0.92, four_sigma(0.92));
  EXPECT_NEAR(without, 0.70, four_sigma(0.70));
}

TEST(CacheDraws, IntervalsHoldInRoomsThatShareAnError) {
  expect_intervals_hold(8, [](const TexelStatistics& s) {
    const TexelErrors e = estimate_errors(s, std::vector<uint32_t>(kSites, 1));
    double within = 0;
    for (size_t i = 0; i < kSites; ++i)
      within += std::abs(double{e.mean[i]} - kLight) <= 1.96 * double{e.standard_error[i]};
    return within / kSites;
  });
}

// The same of a band of two functions, of which one is twice the luminance of E and the other minus that: its
// error is sqrt(8) times as large.
TEST(CacheDraws, IntervalsOfBandsHoldThereToo) {
  expect_intervals_hold(9, [](TexelStatistics& s) {
    s.planes = 9;
    for (uint32_t r = 0; r < kReplicates; ++r) {
      s.mean[r] = ZeroedVector<float>(kSites * s.planes);
      for (size_t i = 0; i < kSites; ++i)
        for (size_t p = 0; p < s.planes; ++p)
          s.mean[r][i * s.planes + p] = s.luminance[r][i] * (p < 3 ? 1.0f : p < 6 ? 2.0f : -2.0f);
    }
    const std::vector<float> e = band_errors(s, std::vector<uint32_t>(kSites, 1), std::vector<size_t>{3, 6});
    double within = 0;
    for (size_t i = 0; i < kSites; ++i) {
      const double mean = 0.5 * (double{s.luminance[0][i]} + double{s.luminance[1][i]});
      within += std::sqrt(8.0) * std::abs(mean - kLight) <= 1.96 * double{e[i]};
    }
    return within / kSites;
  });
}

TEST(CacheDraws, NoneWithoutACache) {
  TexelStatistics s;
  s.sites = 3;
  find_shared(std::vector<uint32_t>(3, 0), s);
  EXPECT_TRUE(s.shared.empty());
}

}  // namespace
}  // namespace kiln
