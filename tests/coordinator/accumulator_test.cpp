#include "coordinator/bake/merge/accumulator.h"

#include <algorithm>
#include <random>

#include "common/responses/quantities.h"
#include "coordinator/bake/sampling/schedule.h"

namespace kiln {
namespace {

constexpr uint32_t kBasis = 1;

// A unit's sums as if every sample of every site were random but fixed.
UnitResult answer(const WorkUnit& unit) {
  UnitResult r;
  r.unit = unit.id;
  r.site_count = static_cast<uint32_t>(unit.sites.size());
  r.plane_count = static_cast<uint32_t>(MomentLayout(kBasis).planes());
  for (uint32_t site : unit.sites) {
    std::mt19937 random((site * 7919 + unit.first_sample) * kReplicates + unit.replicate);
    for (uint32_t p = 0; p < r.plane_count; ++p) r.moments.push_back(random() * 1e-7 * (p % 3 ? 1.0 : 1e-9));
  }
  return r;
}

std::vector<double> merged(std::vector<WorkUnit> units, size_t sites, unsigned shuffle) {
  std::shuffle(units.begin(), units.end(), std::mt19937(shuffle));
  Accumulator sums(sites, MomentLayout(kBasis));
  for (const WorkUnit& u : units) EXPECT_TRUE(sums.add(u, answer(u)));
  std::vector<double> out;
  for (uint32_t s = 0; s < sites; ++s) {
    const auto e = sums.estimate(s);
    out.push_back(e.mean);
    out.push_back(e.standard_error);
    EXPECT_EQ(sums.samples(s), kReplicates * 5000u);
    for (uint32_t r = 0; r < kReplicates; ++r) EXPECT_EQ(sums.samples(s, r), 5000u);
  }
  return out;
}

TEST(Accumulator, OrderOfArrivalAndCutChangeNoBit) {
  const size_t sites = 60;
  std::vector<SiteSamples> all(sites);
  for (uint32_t s = 0; s < sites; ++s) all[s] = {s, {0, 5000}};
  std::vector<double> first;
  for (uint32_t tile : {1u, 20u, 1000u})
    for (unsigned shuffle : {0u, 1u, 2u}) {
      uint64_t id = 0;
      auto units = cut_pass(all, tile, {}, id);
      const auto result = merged(units, sites, shuffle);
      if (first.empty()) first = result;
      EXPECT_EQ(result, first) << tile << " " << shuffle;
    }
}

// Sites taken again begin from nothing; the others keep their bits.
TEST(Accumulator, ClearedSitesAreTakenAgainAndOthersKeepTheirs) {
  constexpr uint32_t kSites = 9;
  Quantities drawn;
  drawn.cache_draws = true;
  const MomentLayout layout(0, drawn);
  const auto add = [&](Accumulator& sums, const WorkUnit& unit) {
    UnitResult r;
    r.site_count = static_cast<uint32_t>(unit.sites.size());
    r.plane_count = static_cast<uint32_t>(layout.planes());
    std::mt19937 random(unit.first_sample * kReplicates + unit.replicate + 100 * unit.take);
    for (size_t i = 0; i < r.site_count * layout.planes(); ++i) r.moments.push_back(random() * 1e-7);
    ASSERT_TRUE(sums.add(unit, r));
  };
  std::vector<SiteSamples> all, again;
  for (uint32_t s = 0; s < kSites; ++s) all.push_back({s, {0, 8}});
  const std::vector<uint32_t> cleared = {1, 4, 8};
  for (const uint32_t s : cleared) again.push_back({s, {0, 16}, 1});
  Accumulator sums(kSites, layout), fresh(kSites, layout), untouched(kSites, layout);
  uint64_t id = 0;
  for (const WorkUnit& u : cut_pass(all, 1000, {}, id)) {
    add(sums, u);
    add(untouched, u);
  }
  sums.renew();
  fresh.renew();
  sums.clear(cleared);
  EXPECT_EQ(sums.samples(4), 0u);
  EXPECT_EQ(sums.cache(0).irradiance[4], Vec3(-1.0f)) << "nothing is cached of what was dropped";
  for (const WorkUnit& u : cut_pass(again, 1000, {}, id)) {
    add(sums, u);
    add(fresh, u);
  }
  for (uint32_t s = 0; s < kSites; ++s) {
    const bool is_cleared = std::count(cleared.begin(), cleared.end(), s) > 0;
    const Accumulator& expected = is_cleared ? fresh : untouched;
    for (uint32_t r = 0; r < kReplicates; ++r) {
      EXPECT_EQ(sums.samples(s, r), is_cleared ? 16u : 8u);
      for (size_t p = 0; p < layout.planes(); ++p) EXPECT_EQ(sums.sum(s, p, r), expected.sum(s, p, r));
      EXPECT_EQ(sums.cache(r).irradiance[s], expected.cache(r).irradiance[s]);
      EXPECT_EQ(sums.cache_samples(r)[s], is_cleared ? 16u : 8u);
    }
  }
}

// Caches hold the light of all lights where it has a sum of its own; the map and its error keep to E, and
// direct light is stored beside it.
TEST(Accumulator, SumsApartGoWhereTheyBelong) {
  Quantities apart;
  apart.direct_apart = apart.all_light = true;
  for (const Quantities& quantities : {Quantities{}, apart}) {
    const MomentLayout layout(0, quantities);
    Accumulator sums(1, layout);
    for (uint32_t replicate = 0; replicate < kReplicates; ++replicate) {
      WorkUnit unit{1 + replicate, 0, 4, {0}};
      unit.replicate = replicate;
      UnitResult r;
      r.unit = unit.id;
      r.site_count = 1;
      r.plane_count = static_cast<uint32_t>(layout.planes());
      r.moments.assign(layout.planes(), 0.0);
      for (size_t c = 0; c < 3; ++c) {
        r.moments[kMomentER + c] = 8;
        if (quantities.direct_apart) r.moments[layout.direct() + c] = 2;
        if (quantities.all_light) r.moments[layout.all_light() + c] = 20;
      }
      r.moments[kMomentLum] = 8;
      r.moments[kMomentLum2] = 16;
      ASSERT_TRUE(sums.add(unit, r));
    }
    EXPECT_EQ(sums.cache(1).irradiance.front(), Vec3(quantities.all_light ? 5.0f : 2.0f));
    EXPECT_EQ(sums.estimate(0).mean, 2);
    const TexelStatistics statistics = sums.statistics();
    ASSERT_EQ(statistics.planes, quantities.direct_apart ? 6u : 3u);
    EXPECT_EQ(statistics.mean[0][2], 2.0f);
    if (quantities.direct_apart) EXPECT_EQ(statistics.mean[0][5], 0.5f);
  }
}

UnitResult of_samples(const WorkUnit& unit, const std::vector<double>& values, double inside = 0) {
  UnitResult r;
  r.unit = unit.id;
  r.site_count = 1;
  r.plane_count = static_cast<uint32_t>(MomentLayout(0).planes());
  r.moments.assign(r.plane_count, 0.0);
  r.moments[kMomentInside] = inside;
  for (double v : values) {
    r.moments[kMomentLum] += v;
    r.moments[kMomentLum2] += v * v;
  }
  return r;
}

TEST(Accumulator, StandardErrorOfKnownSamples) {
  Accumulator sums(1, MomentLayout(0));
  const WorkUnit unit{0, 0, 4, {0}};
  ASSERT_TRUE(sums.add(unit, of_samples(unit, {1, 2, 3, 6})));
  const auto e = sums.estimate(0);
  EXPECT_DOUBLE_EQ(e.mean, 3);
  EXPECT_NEAR(e.standard_error, std::sqrt((4 + 1 + 0 + 9) / 3.0 / 4), 1e-5);
}

TEST(Accumulator, InsideGeometryMeansMoreThanHalfOfTheRays) {
  for (double hits : {2.0, 3.0}) {
    Accumulator sums(1, MomentLayout(0));
    const WorkUnit unit{0, 0, 4, {0}};
    ASSERT_TRUE(sums.add(unit, of_samples(unit, {1, 2, 3, 6}, hits)));
    EXPECT_EQ(sums.estimate(0).inside, hits > 2);
    // Nothing is known of what it gathered, and no path may read it.
    EXPECT_EQ(sums.cache(0).irradiance[0].x<0, hits> 2);
  }
}

TEST(Accumulator, PushedMeansMoreThanHalfOfTheSamples) {
  Atlas atlas;
  atlas.width = atlas.height = 1;
  atlas.sites.texel = {0};
  for (double pushed : {2.0, 3.0}) {
    Accumulator sums(1, MomentLayout(0));
    const WorkUnit unit{0, 0, 4, {0}};
    UnitResult result = of_samples(unit, {1, 2, 3, 6});
    result.moments[kMomentPushed] = pushed;
    ASSERT_TRUE(sums.add(unit, result));
    EXPECT_EQ(sums.resolve(atlas).validity[0], pushed > 2 ? Validity::kPushed : Validity::kMeasured);
    result.moments[kMomentInside] = 3;  // pushed, and still inside
    Accumulator inside(1, MomentLayout(0));
    ASSERT_TRUE(inside.add(unit, result));
    EXPECT_EQ(inside.resolve(atlas).validity[0], Validity::kInside);
  }
}

// Moved samples saw what is outside; paths that meet the texel are inside.
TEST(Accumulator, NothingIsCachedOfATexelWithMovedSamples) {
  for (const double pushed : {0.0, 1.0}) {
    Accumulator sums(1, MomentLayout(0));
    const WorkUnit unit{0, 0, 4, {0}};
    UnitResult result = of_samples(unit, {1, 2, 3, 6});
    result.moments[kMomentPushed] = pushed;
    ASSERT_TRUE(sums.add(unit, result));
    EXPECT_EQ(sums.cache(0).irradiance[0].x<0, pushed> 0);
  }
}

TEST(Accumulator, WrongShapeIsRefused) {
  Accumulator sums(2, MomentLayout(0));
  const WorkUnit unit{0, 0, 4, {0, 1}};
  EXPECT_FALSE(sums.add(unit, of_samples(unit, {1})));
}

TEST(Accumulator, ClearedIsAsNew) {
  Accumulator sums(1, MomentLayout(0));
  const WorkUnit unit{0, 0, 4, {0}}, later{1, 8, 4, {0}};
  ASSERT_TRUE(sums.add(unit, of_samples(unit, {1, 2, 3, 6})));
  ASSERT_TRUE(sums.add(later, of_samples(later, {9, 9, 9, 9})));  // waits for samples 4 to 7
  sums.clear();
  EXPECT_EQ(sums.samples(0), 0u);
  ASSERT_TRUE(sums.add(unit, of_samples(unit, {2, 2, 2, 2})));
  const WorkUnit middle{2, 4, 4, {0}};
  ASSERT_TRUE(sums.add(middle, of_samples(middle, {2, 2, 2, 2})));
  EXPECT_EQ(sums.samples(0), 8u);  // what waited is gone too
  EXPECT_DOUBLE_EQ(sums.estimate(0).mean, 2);
}

// A unit of one site and its samples, in a replicate.
struct Half {
  WorkUnit unit;
  UnitResult result;
  Half(uint32_t site, uint32_t replicate, const std::vector<double>& values, double inside = 0) {
    unit.sites = {site};
    unit.sample_count = static_cast<uint32_t>(values.size());
    unit.replicate = replicate;
    result = of_samples(unit, values, inside);
    for (size_t c = 0; c < 3; ++c) result.moments[kMomentER + c] = (c + 1) * result.moments[kMomentLum];
  }
  void add_to(Accumulator& sums) const { EXPECT_TRUE(sums.add(unit, result)); }
};

TEST(Accumulator, StatisticsAreOfEachReplicate) {
  Accumulator sums(3, MomentLayout(0));
  Half(0, 0, {1, 2, 3}).add_to(sums);
  Half(0, 1, {10, 12, 14}).add_to(sums);
  Half(1, 0, {1, 2}, 2).add_to(sums);  // inside geometry
  Half(1, 1, {1, 2}, 2).add_to(sums);
  Half(2, 0, {5, 5}).add_to(sums);  // its other half is missing
  const TexelStatistics s = sums.statistics();
  ASSERT_EQ(s.sites, 3u);
  EXPECT_EQ(s.known, (std::vector<uint8_t>{1, 0, 0}));
  EXPECT_EQ(s.samples, (std::vector<uint32_t>{3, 2, 0}));
  EXPECT_FLOAT_EQ(s.luminance[0][0], 2);
  EXPECT_FLOAT_EQ(s.luminance[1][0], 12);
  for (uint32_t r = 0; r < kReplicates; ++r)
    for (size_t c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(s.mean[r][c], (c + 1) * s.luminance[r][0]);
  // Of few samples the deviations are all there is: 2 and 8 from the own half's mean, and of both means, 2
  // and 12, from theirs, 6 x 5^2; over 6 samples less one mean.
  EXPECT_FLOAT_EQ(s.variance[0], (2 + 8 + 6 * 25) / 5.0f);
}

TEST(Accumulator, VarianceOfManySamplesIsThatWithinTheHalves) {
  Accumulator sums(1, MomentLayout(0));
  Half(0, 0, {1, 2, 3, 1, 2, 3, 1, 3}).add_to(sums);
  Half(0, 1, {10, 12, 14, 10, 12, 14, 10, 14}).add_to(sums);
  EXPECT_FLOAT_EQ(sums.statistics().variance[0], (6 + 24) / 14.0f);
}

TEST(Accumulator, OneSampleOfEachHalfHasAVariance) {
  Accumulator sums(1, MomentLayout(0));
  Half(0, 0, {1}).add_to(sums);
  Half(0, 1, {4}).add_to(sums);
  EXPECT_FLOAT_EQ(sums.statistics().variance[0], 4.5f);
}

TEST(Accumulator, CacheHoldsMeansOfOneReplicate) {
  Accumulator sums(3, MomentLayout(0));
  Half(0, 0, {1, 2, 3}).add_to(sums);
  Half(0, 1, {10, 12, 14}).add_to(sums);
  Half(1, 0, {1, 2}, 2).add_to(sums);
  Half(1, 1, {1, 2}, 2).add_to(sums);
  Half(2, 0, {0, 0}).add_to(sums);  // black is known
  for (uint32_t r = 0; r < kReplicates; ++r) {
    const IrradianceCache cache = sums.cache(r);
    ASSERT_EQ(cache.irradiance.size(), 3u);
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(cache.irradiance[0][c], (c + 1) * (r ? 12.0f : 2.0f));
    EXPECT_LT(cache.irradiance[1].x, 0) << "inside geometry";
    EXPECT_EQ(cache.irradiance[2].x, r ? -1.0f : 0.0f);
  }
}

// Samples taken by way of an earlier cache do not speak for the next one, but where there are no others.
TEST(Accumulator, CacheHoldsTheLatestSamples) {
  Quantities drawn;
  drawn.cache_draws = true;
  const MomentLayout layout(0, drawn);
  Accumulator sums(2, layout);
  const auto add = [&](uint32_t site, uint32_t first, uint32_t count, double light) {
    WorkUnit unit{first, first, count, {site}};
    UnitResult r;
    r.unit = unit.id, r.site_count = 1, r.plane_count = static_cast<uint32_t>(layout.planes());
    r.moments.assign(layout.planes(), 0.0);
    for (size_t c = 0; c < 3; ++c) r.moments[kMomentER + c] = count * light;
    r.moments[layout.cache_draws() + 1] = count * light / 8;
    ASSERT_TRUE(sums.add(unit, r));
  };
  add(0, 0, 4, 10), add(1, 0, 4, 6);
  EXPECT_EQ(sums.cache(0).irradiance[0].y, 10);
  sums.renew();
  add(0, 4, 2, 4), add(0, 6, 2, 8);  // two passes by way of one cache
  const IrradianceCache cache = sums.cache(0);
  EXPECT_EQ(cache.irradiance[0].y, 6);
  EXPECT_EQ(cache.draws[0][1], 0.75f);
  EXPECT_EQ(cache.irradiance[1].y, 6);
  EXPECT_EQ(sums.cache_samples(0), (std::vector<uint32_t>{4, 4}));
  sums.clear();
  EXPECT_LT(sums.cache(0).irradiance[0].y, 0);
}

// Draws have a place of their own: the planes behind them stay what they are, and nothing of a draw is left
// when a site is cleared.
TEST(Accumulator, DrawsAreKeptApart) {
  Quantities quantities;
  quantities.cache_draws = true;
  quantities.responses = {0};
  const MomentLayout layout(0, quantities);
  ASSERT_GT(layout.response(0), layout.cache_draws());
  Accumulator sums(2, layout);
  const auto add = [&](uint32_t replicate, uint32_t site, uint32_t first, bool draws) {
    WorkUnit unit{first, first, 4, {site}, replicate};
    UnitResult r;
    r.unit = unit.id, r.site_count = 1, r.plane_count = static_cast<uint32_t>(layout.planes());
    for (size_t p = 0; p < layout.planes(); ++p) r.moments.push_back(static_cast<double>(p));
    for (size_t k = 0; k < kCacheDraws; ++k)
      r.moments[layout.cache_draws() + k] = draws ? static_cast<double>(4 * k) : 0;
    r.moments[kMomentInside] = r.moments[kMomentPushed] = 0;
    ASSERT_TRUE(sums.add(unit, r));
  };
  for (const uint32_t r : {0u, 1u})
    for (const uint32_t site : {0u, 1u}) add(r, site, 0, site == 1);
  for (const uint32_t site : {0u, 1u})
    for (size_t p = kMomentER; p < layout.planes(); ++p)
      if (p < layout.cache_draws() || p >= layout.cache_draws() + kCacheDraws)
        EXPECT_EQ(sums.sum(site, p, 1), static_cast<double>(p)) << p;
  const auto drawn = [&](uint32_t site, uint32_t replicate) {
    const TexelStatistics s = sums.statistics(false);
    const float* const of_it = &s.drawn[replicate][site * kCacheDraws];
    return std::vector<float>(of_it, of_it + kCacheDraws);
  };
  const std::vector<float> none(kCacheDraws, 0.0f), some{0, 1, 2, 3};
  EXPECT_EQ(drawn(0, 1), none);
  EXPECT_EQ(drawn(1, 1), some);
  EXPECT_EQ(sums.cache(1).draws[1][3], 3);
  EXPECT_EQ(sums.cache(1).draws[0][3], 0);
  sums.renew();
  add(1, 1, 4, false);
  EXPECT_EQ(sums.cache(1).draws[1][3], 0) << "the latest samples have drawn nothing";
  EXPECT_EQ(drawn(1, 1)[3], 1.5f);
  const std::vector<uint32_t> second{1};
  sums.clear(second);
  for (const uint32_t r : {0u, 1u}) add(r, 1, 0, false);
  EXPECT_EQ(drawn(1, 1), none);
  EXPECT_EQ(sums.cache_samples(1), (std::vector<uint32_t>{4, 4}));
  for (const uint32_t r : {0u, 1u}) add(r, 1, 4, true);
  EXPECT_EQ(drawn(1, 1)[3], 1.5f) << "nothing of before";
  sums.clear();
  for (const uint32_t r : {0u, 1u}) add(r, 1, 0, true);
  EXPECT_EQ(drawn(1, 0), some) << "nothing of before";
}

}  // namespace
}  // namespace kiln
