// Intervals of 1.96 stated standard errors hold the truth as often as they say, for samples of which the
// truth is known. Coverage is counted over all texels of many maps; its bound is 0.95 less what a count of
// as many independent texels scatters by, widened by how far an estimated error makes neighbours alike.
#include "coordinator/bake/sampling/texel_errors.h"

#include <cmath>
#include <random>

#include "common/base/parallel.h"

namespace kiln {
namespace {

constexpr double kZ = 1.96;
using Random = std::mt19937_64;

struct Samples {
  double mean = 0, variance = 0;  // variance: of one sample, as if they were independent
};
// Draws n samples of one replicate of a texel.
using Draw = std::function<Samples(Random&, uint32_t n)>;

Samples of(const std::vector<double>& values) {
  Samples s;
  for (double v : values) s.mean += v / static_cast<double>(values.size());
  for (double v : values)
    s.variance += (v - s.mean) * (v - s.mean) / (static_cast<double>(values.size()) - 1);
  return s;
}

// Independent samples of anything.
template <class One>
Draw independent(One one) {
  return [one](Random& random, uint32_t n) {
    std::vector<double> values(n);
    for (double& v : values) v = one(random);
    return of(values);
  };
}

double uniform(Random& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}
double normal(Random& random) {
  return std::sqrt(-2 * std::log(1 - uniform(random))) * std::cos(2 * M_PI * uniform(random));
}

// A map of texels that are drawn alike. `shared`: added to all means of a replicate by a draw of its own.
TexelStatistics make(size_t sites, uint32_t n, const Draw& draw, Random& random, double shared = 0) {
  TexelStatistics s;
  s.sites = sites;
  s.samples.assign(sites, n);
  s.known.assign(sites, 1);
  s.variance.assign(sites, 0.0f);
  for (uint32_t r = 0; r < kReplicates; ++r) {
    const double common = shared > 0 ? shared * normal(random) : 0;
    for (size_t i = 0; i < sites; ++i) {
      const Samples half = draw(random, n);
      s.luminance[r].push_back(static_cast<float>(half.mean + common));
      s.variance[i] += static_cast<float>(half.variance / kReplicates);
    }
  }
  return s;
}

struct Coverage {
  double share = 0;    // of texels whose interval holds the truth
  double scatter = 0;  // standard deviation of the share, from the spread between maps
  double stated = 0;   // root of the mean of squared stated errors over that of the true ones
};

Coverage cover(const Draw& draw, double truth, uint32_t n, int maps, size_t sites, double shared = 0) {
  Random random(2024);
  std::vector<double> shares;
  double stated = 0, actual = 0;
  const std::vector<uint32_t> one_chart(sites, 1);
  for (int m = 0; m < maps; ++m) {
    const TexelErrors e = estimate_errors(make(sites, n, draw, random, shared), one_chart);
    size_t within = 0;
    for (size_t i = 0; i < sites; ++i) {
      within += std::abs(e.mean[i] - truth) <= kZ * e.standard_error[i];
      stated += std::pow(e.standard_error[i], 2);
      actual += std::pow(e.mean[i] - truth, 2);
    }
    shares.push_back(static_cast<double>(within) / static_cast<double>(sites));
  }
  Coverage c;
  for (double s : shares) c.share += s / maps;
  for (double s : shares) c.scatter += (s - c.share) * (s - c.share) / (maps - 1);
  // Of the mean share: from the maps, which are independent, and no less than the binomial's.
  c.scatter = std::sqrt(std::max(c.scatter / maps, 0.95 * 0.05 / (maps * static_cast<double>(sites))));
  c.stated = std::sqrt(stated / actual);
  std::printf("coverage %.4f +- %.4f, stated / true error %.3f\n", c.share, c.scatter, c.stated);
  return c;
}

constexpr int kMaps = 20;
constexpr size_t kSites = 1000;

TEST(TexelErrors, NormalSamples) {
  const Coverage c = cover(independent([](Random& r) { return 5 + normal(r); }), 5, 16, kMaps, kSites);
  EXPECT_NEAR(c.share, 0.95, 4 * c.scatter);
  EXPECT_NEAR(c.stated, 1, 0.03);
}

TEST(TexelErrors, ExponentialSamples) {
  const Coverage c =
      cover(independent([](Random& r) { return -std::log(1 - uniform(r)); }), 1, 64, kMaps, kSites);
  EXPECT_NEAR(c.share, 0.95, 4 * c.scatter);
  EXPECT_NEAR(c.stated, 1, 0.03);
}

TEST(TexelErrors, RareBrightSamples) {
  // One in 100 is 100 times as bright; with 2 x 32 samples half of the texels meet none. By its own variance
  // such a texel is almost sure of a mean of half the truth.
  const auto rare = independent([](Random& r) { return uniform(r) < 0.01 ? 100.0 : 1.0; });
  const double truth = 0.01 * 100 + 0.99, p = 0.01;
  const Coverage c = cover(rare, truth, 32, kMaps, kSites);
  // What intervals of the true error would hold: a binomial count k of 64 with |mean - truth| within.
  double exact = 0;
  const double reach = kZ * 99 * std::sqrt(p * (1 - p) / 64);
  double term = std::pow(1 - p, 64);
  for (int k = 0; k <= 64; ++k) {
    if (std::abs(1 + 99.0 * k / 64 - truth) <= reach) exact += term;
    term *= (64.0 - k) / (k + 1) * p / (1 - p);
  }
  EXPECT_GE(c.share, std::min(exact, 0.95) - 0.02 - 4 * c.scatter) << exact;
}

// A texel that missed the bright samples of its neighbours is dimmer by a sixth. Its own 512 samples would
// state a thirtieth of the error.
TEST(TexelErrors, MissedBrightSamplesAreNoContradiction) {
  Random random(8);
  constexpr uint32_t kEach = 256;
  constexpr double kRate = 1.0 / 400, kBright = 80, kNoise = 0.1;
  TexelStatistics s =
      make(2000, kEach,
           independent([](Random& r) { return (uniform(r) < kRate ? kBright : 0) + 1 + kNoise * normal(r); }),
           random);
  s.shared.assign(s.sites, 0.0f);
  const TexelErrors e = estimate_errors(s, std::vector<uint32_t>(s.sites, 1));
  const double half = std::sqrt(0.5 * kRate * kBright * kBright / (kReplicates * kEach));
  size_t missed = 0;
  for (size_t i = 0; i < s.sites; ++i) {
    if (s.variance[i] > 1) continue;
    ++missed;
    // Of a neighbourhood with some 60 bright samples.
    EXPECT_GT(e.standard_error[i], 0.5 * half) << i;
  }
  EXPECT_GT(missed, 400u);
}

TEST(TexelErrors, StratifiedSamples) {
  // The mean's variance is a tenth of what independent samples of the same variance would have.
  const Draw stratified = [](Random& random, uint32_t n) {
    return Samples{5 + normal(random) * std::sqrt(0.1 / n), 1};
  };
  const Coverage c = cover(stratified, 5, 64, kMaps, kSites);
  EXPECT_NEAR(c.share, 0.95, 4 * c.scatter);
  EXPECT_NEAR(c.stated, 1, 0.03);
}

TEST(TexelErrors, ErrorThatTexelsOfAReplicateShare) {
  // A cache's error goes to all texels of a replicate alike: the difference of the replicates has one degree
  // of freedom for it on a map, whose interval is right in the mean over squares, not on each map.
  const Draw own = [](Random& random, uint32_t n) { return Samples{5 + normal(random) / std::sqrt(n), 1}; };
  const double shared = 1 / std::sqrt(64.0);
  const Coverage c = cover(own, 5, 64, 400, 300, shared);
  EXPECT_NEAR(c.stated, 1, 0.1);
  // Without the difference of the replicates the interval would be 1/sqrt(2) of the true one: 0.834.
  EXPECT_GE(c.share, 0.85 + 2 * c.scatter);
}

TEST(TexelErrors, BlackIsSureAndUnknownIsInfinite) {
  Random random(1);
  TexelStatistics s = make(300, 16, independent([](Random&) { return 0.0; }), random);
  s.known[7] = 0;
  const TexelErrors e = estimate_errors(s, std::vector<uint32_t>(300, 1));
  for (size_t i = 0; i < 300; ++i) {
    EXPECT_EQ(e.mean[i], 0);
    EXPECT_EQ(e.standard_error[i], i == 7 ? INFINITY : 0.0f);
  }
}

TEST(TexelErrors, WhatIsNotKnownCountsNowhere) {
  Random random(3);
  TexelStatistics s = make(400, 16, independent([](Random& r) { return 5 + normal(r); }), random);
  for (size_t i = 0; i < 400; i += 3) s.known[i] = 0;
  TexelStatistics wild = s;
  for (size_t i = 0; i < 400; i += 3) {
    wild.variance[i] = 1e6f;
    wild.luminance[0][i] = 1e6f;
    wild.samples[i] = 0;
  }
  const std::vector<uint32_t> charts(400, 1);
  EXPECT_EQ(estimate_errors(s, charts).standard_error, estimate_errors(wild, charts).standard_error);
}

TEST(TexelErrors, OtherChartsLendNoVariance) {
  Random random(4);
  TexelStatistics s = make(400, 16, independent([](Random& r) { return 5 + normal(r); }), random);
  std::vector<uint32_t> charts(400, 1);
  for (size_t i = 0; i < 400; i += 2) {
    charts[i] = 2;
    s.variance[i] *= 10000;
    for (uint32_t r = 0; r < kReplicates; ++r) s.luminance[r][i] = 5 + 100 * (s.luminance[r][i] - 5);
  }
  const TexelErrors e = estimate_errors(s, charts);
  double near = 0, far = 0;
  for (size_t i = 0; i < 400; ++i) (i % 2 ? near : far) += e.standard_error[i] / 200;
  EXPECT_NEAR(far / near, 100, 5);
}

// The corner of a dark room: one texel in eight of its chart is in the light of the doorway, and every other
// site belongs to a bright room. The dark share an error by way of the cache, which is not that of the
// bright.
TEST(TexelErrors, BrightTexelsDoNotStandForDarkOnesNorDarkForBright) {
  Random random(6);
  constexpr size_t kTexels = 800;
  constexpr uint32_t kEach = 2048;
  constexpr double kDark = 0.02, kShared = 0.3;
  const auto is_bright = [](size_t i) { return i % 2 == 0 || i % 16 == 1; };
  TexelStatistics s = make(kTexels, kEach, independent([](Random& r) { return 1 + normal(r); }), random);
  std::vector<uint32_t> charts(kTexels);
  s.shared.assign(kTexels, 0.0f);
  for (size_t i = 0; i < kTexels; ++i) {
    charts[i] = 1 + i % 2;
    if (is_bright(i)) continue;
    s.variance[i] *= static_cast<float>(kDark * kDark);
    s.shared[i] = static_cast<float>(kShared * kShared);
    for (uint32_t r = 0; r < kReplicates; ++r)
      s.luminance[r][i] = static_cast<float>(kDark * (s.luminance[r][i] + (r ? -kShared : kShared)));
  }
  const TexelErrors e = estimate_errors(s, charts);
  const double own = 1 / std::sqrt(kReplicates * kEach);
  for (size_t i = 0; i < kTexels; ++i) {
    if (is_bright(i)) {
      // Its own noise, and what a tenth of the texels may add to q.
      EXPECT_NEAR(e.standard_error[i] / own, 1, 0.3) << i;
    } else {
      // What it shares, and little more: the bright ones around lend it no variance.
      EXPECT_NEAR(e.standard_error[i] / (kDark * kShared), 1, 0.25) << i;
    }
  }
}

// A chart of two texels whose replicates differ by chance, one this way and one that way: what they seem to
// share is below 0 by more than their own variance.
TEST(TexelErrors, ChanceDoesNotTakeAwayATexelsOwnVariance) {
  Random random(9);
  constexpr uint32_t kEach = 200;
  constexpr double kOwn = 0.05;  // of the mean of both replicates, 1 / sqrt(2 kEach)
  TexelStatistics s = make(200, kEach, independent([](Random& r) { return 5 + normal(r); }), random);
  s.shared.assign(s.sites, 0.0f);
  std::vector<uint32_t> charts(s.sites, 1);
  for (const size_t i : {100u, 101u}) {
    charts[i] = 2;
    s.luminance[0][i] = i == 100 ? 5.3f : 4.7f;
    s.luminance[1][i] = i == 100 ? 4.7f : 5.3f;
  }
  const TexelErrors e = estimate_errors(s, charts);
  for (const size_t i : {100u, 101u}) EXPECT_GT(e.standard_error[i], 0.8 * kOwn);
}

TEST(TexelErrors, TexelFarAwayChangesNothing) {
  Random random(5);
  TexelStatistics s = make(1000, 16, independent([](Random& r) { return 5 + normal(r); }), random);
  const std::vector<uint32_t> charts(1000, 1);
  const TexelErrors before = estimate_errors(s, charts);
  s.luminance[0][900] = 9;
  s.variance[900] = 4;
  const TexelErrors after = estimate_errors(s, charts);
  for (size_t i = 0; i + kReplicateNeighbours + kVarianceNeighbours < 900; ++i)
    EXPECT_EQ(before.standard_error[i], after.standard_error[i]);
}

}  // namespace
}  // namespace kiln
