// What the conductor asks a farm for, pass after pass, and what it makes of the answers.
#include <cmath>
#include <set>
#include <tuple>

#include "common/base/statistics.h"
#include "common/job/irradiance_cache.h"
#include "coordinator/bake/sampling/settling.h"
#include "tests/bake/stub_farm.h"

namespace kiln {
namespace {

using test::by_number;
using test::noisy;
using test::Stub;
using Passes = test::Passes;

// The same samples by cache after cache would add up the same noise.
TEST_F(Passes, SamplesTakenAgainAreOthers) {
  request_.settings.min_samples = request_.settings.max_samples = 128;
  Stub stub;
  stub.light = noisy;
  const BakeReport report = bake(stub);
  ASSERT_GE(dropped(report), 1u);
  std::set<std::tuple<uint32_t, uint32_t, uint32_t, uint32_t>> taken;  // take, replicate, site, sample
  for (const auto& call : stub.calls)
    for (const WorkUnit& unit : call)
      for (const uint32_t site : unit.sites)
        for (uint32_t k = 0; k < unit.sample_count; ++k)
          EXPECT_TRUE(taken.insert({unit.take, unit.replicate, site, unit.first_sample + k}).second);
  std::set<uint64_t> seeds;
  for (uint32_t take = 0; take < 3; ++take)
    for (uint32_t r = 0; r < kReplicates; ++r) seeds.insert(replicate_seed(7, r, take));
  EXPECT_EQ(seeds.size(), 3u * kReplicates);
  EXPECT_EQ(replicate_seed(7, 0, 0), 7u);
}

TEST_F(Passes, EachReplicateReadsWhatItFoundItself) {
  // What replicates differ by is only their error if neither knows anything of the other.
  request_.settings.min_samples = request_.settings.max_samples = 128;
  Stub stub;
  stub.light = [](uint32_t, uint32_t replicate, uint32_t) { return 1.0 + replicate; };
  bake(stub);
  ASSERT_GE(stub.calls.size(), 3u);
  for (const WorkUnit& unit : stub.calls[0])
    EXPECT_EQ(unit.cache, Digest{}) << "nothing is known before the first pass";
  const size_t sites = sites_of(stub.calls[0]);
  std::set<std::vector<size_t>> unknown;  // by site, of each cache: half hidden texels, where no path ends
  for (size_t call = 1; call < stub.calls.size(); ++call)
    for (uint32_t r = 0; r < kReplicates; ++r) {
      std::set<Digest> named;
      for (const WorkUnit& unit : stub.calls[call])
        if (unit.replicate == r) named.insert(unit.cache);
      ASSERT_EQ(named.size(), 1u) << "pass " << call;
      ASSERT_TRUE(stub.chunks.count(*named.begin())) << "pass " << call;
      const auto cache = read_irradiance_cache(stub.chunks[*named.begin()], sites);
      ASSERT_TRUE(cache);
      std::vector<size_t> none;
      for (size_t site = 0; site < sites; ++site) {
        const Vec3& e = cache->irradiance[site];
        if (e == Vec3(-1.0f))
          none.push_back(site);
        else
          ASSERT_EQ(e, Vec3(1, 2, 3) * (1.0f + r)) << "pass " << call;
      }
      unknown.insert(none);
    }
  // They follow from the geometry: the same in every cache, and few.
  ASSERT_EQ(unknown.size(), 1u);
  EXPECT_LT(4 * unknown.begin()->size(), sites);
}

TEST_F(Passes, CachesFollowWhatIsFound) {
  // A cache stays what it was while samples are few, and its error is in all that read it.
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 2000;
  request_.settings.error = 0.05;
  Stub stub;
  stub.light = noisy;
  const BakeReport report = bake(stub);
  ASSERT_EQ(report.passes.size(), stub.calls.size());
  // Of the first pass that lasts, and of the last one.
  const size_t first = dropped(report);
  ASSERT_GT(report.passes.back().samples, 4 * report.passes[first].samples);
  for (const WorkUnit& now : stub.calls.back())
    for (const WorkUnit& then : stub.calls[first]) ASSERT_NE(now.cache, then.cache);
}

// The error of a cache that most samples came by would otherwise be handed on for long.
TEST_F(Passes, CachesAreMadeOfTheSamplesSinceTheOneBefore) {
  request_.settings.min_samples = request_.settings.max_samples = 2048;
  Stub stub;
  stub.light = [&](uint32_t, uint32_t, uint32_t) { return static_cast<double>(stub.calls.size()); };
  bake(stub);
  size_t caches = 0;
  double sum = 0, count = 0;  // of a texel, since a cache was made
  Digest before;
  for (size_t call = 0; call < stub.calls.size(); ++call) {
    const WorkUnit unit = by_number(stub.calls[call]).front();
    if (unit.cache != before) {
      const auto cache = read_irradiance_cache(stub.chunks.at(unit.cache), sites_of(stub.calls[0]));
      ASSERT_TRUE(cache);
      for (const Vec3& e : cache->irradiance)
        if (e.x >= 0) ASSERT_NEAR(e.x, sum / count, 1e-5 * sum / count) << "pass " << call;
      sum = count = 0;
      before = unit.cache;
      ++caches;
    }
    sum += unit.sample_count * static_cast<double>(call + 1);
    count += unit.sample_count;
  }
  EXPECT_GT(caches, 3u);
}

// What paths bring back of a cache's errors goes into the next one with the noise of its samples, and into
// what is stated: once as the mean of the draws, once in nine as the replicates' difference, which has none.
TEST_F(Passes, ErrorsDrawnOfCachesAreHandedOnAndStated) {
  request_.settings.min_samples = request_.settings.max_samples = 128;
  for (const bool denoise : {false, true}) {
    request_.settings.denoise = denoise;
    Stub stub;
    stub.light = [](uint32_t site, uint32_t replicate, uint32_t sample) {
      return 1 + 0.01 * (noisy(site, replicate, sample) - 1);
    };
    stub.drawn = 0.125;
    const BakeReport report = bake(stub);
    const double stated = stub.drawn * std::sqrt(8.0 / 9 / 2);
    EXPECT_NEAR(report.passes.back().rms_relative, stated, 0.002) << denoise;
    EXPECT_NEAR(report.statement.median_relative, stated, 0.002) << denoise;
    const Digest last = by_number(stub.calls.back()).front().cache;
    const auto cache = read_irradiance_cache(stub.chunks.at(last), sites_of(stub.calls[0]));
    ASSERT_TRUE(cache);
    size_t differ = 0;
    for (const CacheDraws& draws : cache->draws)
      for (uint32_t k = 0; k < kCacheDraws; ++k) {
        EXPECT_NEAR(draws[k], stub.drawn, 0.01);
        differ += draws[k] != stub.drawn;
      }
    EXPECT_GT(differ, cache->draws.size());
  }
}

TEST_F(Passes, WhatOnlyMakesTheCacheIsInNoTexel) {
  // Brighter as long as a cache is made: the map must show nothing of it.
  request_.settings.min_samples = request_.settings.max_samples = 128;
  Stub stub;
  stub.light = [&](uint32_t, uint32_t, uint32_t) { return stub.calls.size() <= 2 ? 8.0 : 1.0; };
  stub.drawn = 8;
  stub.drawn_until = 2;
  const BakeReport report = bake(stub);
  ASSERT_EQ(report.passes.size(), stub.calls.size());
  double samples = 0;
  for (size_t i = 0; i < stub.calls.size(); ++i) {
    EXPECT_EQ(report.passes[i].kept, i >= 2) << i;
    if (i < 2) continue;
    for (const WorkUnit& unit : stub.calls[i]) samples += unit.sites.front() == 0 ? unit.sample_count : 0;
  }
  EXPECT_EQ(samples, 128);
  Stub dim;
  dim.light = [](uint32_t, uint32_t, uint32_t) { return 1.0; };
  dim.drawn = stub.drawn;
  dim.drawn_until = stub.drawn_until;
  EXPECT_EQ(masters(report), masters(bake(dim)));
}

// Under even light a few samples are enough, and a large map has many such texels.
TEST_F(Passes, LargeMapsBeginWithFewSamples) {
  Stub stub;
  const BakeReport report = bake_even_light(50, stub);
  ASSERT_GE(sites_of(stub.calls[0]), size_t{1} << 17);
  EXPECT_EQ(report.passes.back().samples, 16);
  EXPECT_EQ(report.settings.min_samples, 16u) << "reports show what holds";
  EXPECT_EQ(report.plan.least_samples, 16u);

  request_.settings.source["min-samples"] = "the command line";
  Stub given;
  given.light = stub.light;
  EXPECT_EQ(bake(given).passes.back().samples, 64);
}

// The first cache of a map of millions of texels is made of one of four, those between have what these say.
TEST_F(Passes, MapsOfMillionsBeginWithOneTexelOfFour) {
  Stub stub;
  const BakeReport report = bake_even_light(142, stub);
  const size_t first = sites_of(stub.calls[0]), all = report.plan.valid_texels;
  ASSERT_GE(all, size_t{1} << 20);
  EXPECT_GT(4 * first, all);
  EXPECT_LT(4 * first, 1.03 * static_cast<double>(all));
  EXPECT_FALSE(report.passes[0].kept);
  EXPECT_EQ(sites_of(stub.calls[1]), all);
  const auto cache = read_irradiance_cache(stub.chunks.at(stub.calls[1][0].cache), all);
  ASSERT_TRUE(cache);
  size_t none = 0;  // of texels that mislead
  for (const Vec3& light : cache->irradiance) {
    none += light == Vec3(-1.0f);
    if (light != Vec3(-1.0f)) ASSERT_LT(length(light - Vec3(1, 2, 3)), 1e-5f);
  }
  EXPECT_LT(4 * none, all);

  request_.settings.denoise = false;
  Stub raw;
  raw.light = stub.light;
  bake(raw);
  EXPECT_EQ(sites_of(raw.calls[0]), all) << "nothing tells the errors of those between";
}

// What sites have whose error is that of the caches is dropped and taken again before the large passes.
TEST_F(Passes, SitesThatErrByTheirCachesBeginAgain) {
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 8192;
  request_.settings.error = 0.02;
  Stub stub;
  stub.light = noisy;
  stub.drawn = 0.03;
  const size_t sites = room_sites();
  stub.drawn_from = static_cast<uint32_t>(sites / 2);
  stub.drawn_until = 6;
  const BakeReport report = bake(stub);
  std::map<uint32_t, std::set<uint32_t>> takes;  // by site
  std::map<uint32_t, uint32_t> samples;          // of its last take
  std::set<std::tuple<uint32_t, uint32_t, uint32_t, uint32_t>> taken;
  for (const auto& call : stub.calls)
    for (const WorkUnit& unit : by_number(call))
      for (const uint32_t site : unit.sites) {
        if (takes[site].insert(unit.take).second) samples[site] = 0;
        ASSERT_EQ(unit.take, *takes[site].rbegin()) << "takes follow each other";
        samples[site] += unit.sample_count;
        ASSERT_TRUE(taken.insert({unit.take, unit.replicate, site, unit.first_sample}).second);
      }
  double total = 0;
  for (const auto& [site, count] : samples) total += count;
  EXPECT_NEAR(report.passes.back().samples, total / static_cast<double>(sites), 1e-6) << "of the last takes";
  // Sites in the middle of either half: what texels share is a mean over those around.
  const size_t of_all = takes[static_cast<uint32_t>(sites / 4)].size();
  EXPECT_EQ(of_all, dropped(report) + 1);
  EXPECT_GT(takes[static_cast<uint32_t>(3 * sites / 4)].size(), of_all);
  // The map's errors are found after the last of these rounds.
  std::vector<size_t> rounds;
  for (size_t i = 0; i < stub.calls.size(); ++i)
    if (stub.calls[i].front().first_sample == 0 && sites_of(stub.calls[i]) < sites) rounds.push_back(i);
  ASSERT_GE(rounds.size(), 3u);
  ASSERT_EQ(report.passes.size(), stub.calls.size());
  const double before = report.passes[rounds.front() - 1].rms_relative;
  for (const size_t i : rounds) EXPECT_GT(report.passes[i - 1].seconds_left, 0) << "all passes to come count";
  for (const size_t i : rounds)
    if (i == rounds.back())
      EXPECT_LT(report.passes[i].rms_relative, 0.9 * before);
    else
      EXPECT_EQ(report.passes[i].rms_relative, before);
}

// Sites with next to no light begin again only if the norm asks each of them.
TEST_F(Passes, SitesThatHardlyCountInTheNormDoNotBeginAgain) {
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 1024;
  request_.settings.error = 0.02;
  const size_t sites = room_sites();
  constexpr double kDim = 1e-4;  // of the others' light
  const auto takes_of_dim = [&](const char* norm) {
    request_.settings.error_norm = norm;
    Stub stub;
    stub.drawn_from = static_cast<uint32_t>(sites / 2);
    stub.drawn = 0.03 * kDim;
    stub.light = [&](uint32_t site, uint32_t replicate, uint32_t sample) {
      return noisy(site, replicate, sample) * (site < stub.drawn_from ? 1 : kDim);
    };
    const BakeReport report = bake(stub);
    std::set<uint32_t> takes;
    for (const auto& call : stub.calls)
      for (const WorkUnit& unit : call)
        if (std::count(unit.sites.begin(), unit.sites.end(), 3 * sites / 4)) takes.insert(unit.take);
    return takes.size() - dropped(report);
  };
  EXPECT_EQ(takes_of_dim("mean-square"), 1u);
  EXPECT_GT(takes_of_dim("max"), 1u);
}

// Where no cache helps rounds double, and end at their share of the samples that are to come after them.
TEST_F(Passes, RoundsTakeNoMoreThanTheirShare) {
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 65536;
  request_.settings.error = 0.01;
  request_.settings.denoise = false;
  Stub stub;
  stub.light = noisy;
  stub.drawn = 0.03;
  const BakeReport report = bake(stub);
  const size_t sites = sites_of(stub.calls[0]);
  const size_t first = dropped(report);  // the first pass that lasts: rounds follow
  const PassPoint& before = report.passes[first];
  // If all sites need as many samples, which is the most that the norm asks for.
  const double needed = before.samples * std::pow(normal_interval(0.95) * before.rms_relative / 0.01, 2);
  const double to_come = static_cast<double>(sites) * (needed - before.samples);
  double taken = 0, round = 0;
  for (size_t i = first + 1; i < stub.calls.size() && stub.calls[i].front().first_sample == 0; ++i) {
    round = 0;
    for (const WorkUnit& unit : stub.calls[i])
      round += static_cast<double>(unit.sites.size()) * unit.sample_count;
    EXPECT_LE(round, kSettlingRound * to_come) << i;
    taken += round;
  }
  EXPECT_LE(taken, kSettlingShare * to_come);
  EXPECT_GT(2 * round, kSettlingRound * to_come);  // the next one would be too large
}

// A few sites whose error no cache lowers are left out of later caches.
TEST_F(Passes, FewSitesThatDoNotSettleAreLeftOutOfTheCaches) {
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 8192;
  request_.settings.error = 0.02;
  request_.settings.texels_per_metre = 20;
  const size_t sites = room_sites();
  Stub stub;
  stub.light = noisy;
  stub.drawn = 1;
  stub.drawn_from = static_cast<uint32_t>(sites - sites / 200);
  bake(stub);
  const auto left_out = [&](const std::vector<WorkUnit>& call) {
    std::set<uint32_t> out;
    const auto cache = read_irradiance_cache(stub.chunks.at(call.front().cache), sites);
    for (uint32_t site = 0; cache && site < sites; ++site)
      if (cache->irradiance[site].x < 0) out.insert(site);
    return out;
  };
  const std::set<uint32_t> early = left_out(stub.calls[1]), late = left_out(stub.calls.back());
  EXPECT_GT(late.size(), early.size());
  EXPECT_LE(late.size(), early.size() + sites / 50);
  EXPECT_FALSE(early.count(static_cast<uint32_t>(sites - 1)));
  EXPECT_TRUE(late.count(static_cast<uint32_t>(sites - 1)));
  EXPECT_EQ(late.count(static_cast<uint32_t>(sites / 2)), early.count(static_cast<uint32_t>(sites / 2)));
}

uint32_t most_takes(const Stub& stub) {
  uint32_t most = 0;
  for (const auto& call : stub.calls)
    for (const WorkUnit& unit : call) most = std::max(most, unit.take + 1);
  return most;
}

TEST_F(Passes, ARewoundJobIsBakedAsIfForTheFirstTime) {
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 4096;
  // With an error of 0.02 the run before the rewind, whose draws do not fall, ends in fewer passes.
  request_.settings.error = 0.03;
  for (const bool cache : {false, true}) {
    request_.settings.cache = cache;
    Stub plain;
    plain.light = noisy;
    plain.drawn = 0.03;
    plain.drawn_until = 4;
    const BakeReport expected = bake(plain);
    ASSERT_GE(plain.calls.size(), 3u);
    if (cache) ASSERT_GT(most_takes(plain), dropped(expected) + 1) << "sites settle";
    for (size_t at = 0; at < plain.calls.size(); ++at) {
      Stub rewound = plain;
      rewound.calls.clear();
      rewound.drawn_until = at + 1 + plain.drawn_until;
      rewound.rewind_at = at;
      const BakeReport report = bake(rewound);
      EXPECT_EQ(masters(report), masters(expected)) << "rewound in pass " << at;
      EXPECT_EQ(report.passes.size(), expected.passes.size());
      // What a store kept of the run before is found by the numbers of units.
      ASSERT_EQ(rewound.calls.size(), at + 1 + plain.calls.size());
      for (size_t i = 0; i < plain.calls.size(); ++i) {
        const std::vector<WorkUnit> a = by_number(plain.calls[i]), b = by_number(rewound.calls[at + 1 + i]);
        ASSERT_EQ(a.size(), b.size());
        for (size_t u = 0; u < a.size(); ++u) {
          ASSERT_EQ(a[u].id, b[u].id);
          ASSERT_EQ(a[u].sites, b[u].sites);
          ASSERT_EQ(a[u].first_sample, b[u].first_sample);
          ASSERT_EQ(a[u].cache, b[u].cache);
          ASSERT_EQ(a[u].take, b[u].take);
        }
      }
    }
  }
}

TEST_F(Passes, EveryTexelGetsTheLeast) {
  // Light without noise meets any error at once.
  request_.settings.min_samples = 256;
  request_.settings.max_samples = 4096;
  for (const bool cache : {false, true}) {
    request_.settings.cache = cache;
    Stub stub;
    stub.light = [](uint32_t, uint32_t, uint32_t) { return 1.0; };
    const BakeReport report = bake(stub);
    EXPECT_EQ(report.passes.back().samples, 256) << "cache " << cache;
    // In one go, or in steps: what the first of them was read from is the roughest.
    EXPECT_EQ(report.passes[dropped(report)].samples < 256, cache);
  }
}

TEST_F(Passes, ARoughCacheIsMadeBetterWhileThatHelps) {
  request_.settings.min_samples = request_.settings.max_samples = 512;
  Stub even, rough, noise;
  even.light = [](uint32_t, uint32_t, uint32_t) { return 1.0; };
  // Every pass finds light twice as often as the one before, as if for its better cache.
  rough.light = [&](uint32_t site, uint32_t replicate, uint32_t sample) {
    const double chance = std::min(1.0, 0.1 * std::pow(2.0, static_cast<double>(rough.calls.size())));
    return noisy(site, replicate, sample) < chance ? 1 / chance : 0.0;
  };
  // As noisy, whatever the cache: the samples that show it are kept.
  noise.light = [](uint32_t site, uint32_t replicate, uint32_t sample) {
    return noisy(site, replicate, sample) < 0.02 ? 50.0 : 0.0;
  };
  for (Stub* stub : {&even, &rough, &noise}) stub->drawn = 0.2;
  const BakeReport a = bake(even), b = bake(rough), c = bake(noise);
  EXPECT_EQ(dropped(a), 2u);
  EXPECT_GT(dropped(b), 2u);
  EXPECT_EQ(dropped(c), 2u);
  for (const BakeReport* report : {&a, &b, &c}) EXPECT_EQ(report->passes.back().samples, 512);
}

// Where few sites have errors of the caches, these settle, and the first pass that ends at caches lasts.
TEST_F(Passes, TheFirstCachedSamplesLastWhereFewSitesErrByTheirCaches) {
  request_.settings.min_samples = request_.settings.max_samples = 512;
  Stub stub;
  stub.light = noisy;
  const BakeReport report = bake(stub);
  EXPECT_EQ(dropped(report), 1u);
  EXPECT_EQ(report.passes.back().samples, 512);
  EXPECT_EQ(stub.calls[0].front().cache, Digest{});
  EXPECT_NE(stub.calls[1].front().cache, Digest{});
  const size_t sites = sites_of(stub.calls[0]);
  for (const bool many : {false, true}) {
    Stub err = stub;
    err.calls.clear();
    err.drawn = 1;
    err.drawn_from = static_cast<uint32_t>((many ? 0.7 : 0.9) * static_cast<double>(sites));
    EXPECT_EQ(dropped(bake(err)) > 1, many);
  }
}

// A better cache is not worth more than a quarter of the samples that are still missing.
TEST_F(Passes, ARoundForTheCachesIsSmallBesideWhatIsMissing) {
  for (const uint32_t samples : {64u, 128u}) {
    request_.settings.min_samples = request_.settings.max_samples = samples;
    Stub stub;
    stub.light = [](uint32_t, uint32_t, uint32_t) { return 1.0; };
    EXPECT_EQ(dropped(bake(stub)), samples == 64 ? 1u : 2u) << samples;
  }
  request_.settings.min_samples = 64;
  request_.settings.max_samples = 8192;
  for (const double error : {0.5, 0.05}) {
    request_.settings.error = error;
    Stub stub;
    stub.light = noisy;
    stub.drawn = 0.1;
    EXPECT_EQ(dropped(bake(stub)) > 1, error == 0.05) << error;
  }
}

TEST_F(Passes, NoCacheIsMadeThatNoPassReads) {
  request_.settings.min_samples = request_.settings.max_samples = 2048;
  Stub stub;
  stub.light = noisy;
  bake(stub);
  std::set<Digest> read;
  for (const auto& call : stub.calls)
    for (const WorkUnit& unit : call) read.insert(unit.cache);
  EXPECT_GT(stub.chunks.size(), size_t{kReplicates});
  for (const auto& [digest, bytes] : stub.chunks) EXPECT_TRUE(read.count(digest));
}

TEST_F(Passes, NoTexelGrowsByMuchMoreThanFourTimes) {
  // Of few samples not even their error is known well. Counts are rounded up by less than a quarter.
  request_.settings.min_samples = 16;
  request_.settings.max_samples = 4000;
  request_.settings.error = 1e-3;
  request_.settings.cache = false;
  Stub stub;
  stub.light = noisy;
  EXPECT_GT(bake(stub).passes.back().samples, 3000);
  std::map<uint32_t, uint32_t> have;
  for (const std::vector<WorkUnit>& call : stub.calls) {
    const std::map<uint32_t, uint32_t> before = have;
    for (const WorkUnit& unit : call)
      for (const uint32_t site : unit.sites) {
        const uint32_t to = unit.first_sample + unit.sample_count;
        have[site] = std::max(have[site], to);
        if (&call != &stub.calls[0]) ASSERT_LE(to, 5 * before.at(site));
      }
  }
}

// Few texels with much noise take most of the samples, where the norm is that of the map as a whole.
TEST_F(Passes, OnlyTheNormMeanSquareGivesATexelMoreThanTheDefaultOfTheOthers) {
  request_.settings.min_samples = 16;
  request_.settings.max_samples = 1 << 18;
  request_.settings.error = 0.005;
  request_.settings.cache = false;
  const auto most = [&](const char* norm) {
    request_.settings.error_norm = norm;
    Stub stub;
    stub.light = [](uint32_t site, uint32_t replicate, uint32_t sample) {
      return 1 + (site % 10 == 0 ? 4.0 : 0.01) * (noisy(site, replicate, sample) - 1);
    };
    bake(stub);
    uint32_t last = 0;
    for (const std::vector<WorkUnit>& call : stub.calls)
      for (const WorkUnit& unit : call) last = std::max(last, unit.first_sample + unit.sample_count);
    return kReplicates * last;
  };
  EXPECT_GT(most("mean-square"), 16384u);
  EXPECT_EQ(most("max"), 16384u);
}

}  // namespace
}  // namespace kiln
