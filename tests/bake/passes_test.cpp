// What the conductor asks a farm for, pass after pass, and what it makes of the answers. The farm is a stub:
// no process and no ray.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <thread>
#include <tuple>

#include "common/job/irradiance_cache.h"
#include "common/math/sequence.h"
#include "common/responses/quantities.h"
#include "coordinator/run/bake_run.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

// What a farm was asked for and what it does about it. Outlives the job.
struct Stub {
  // Luminance of a sample; E is once, twice and three times that.
  std::function<double(uint32_t site, uint32_t replicate, uint32_t sample)> light;
  double drawn = 0;                 // every error drawn of a sample
  uint32_t drawn_from = 0;          // of this site and those after it
  size_t drawn_until = ~size_t{0};  // until this call of run_pass, and a quarter of it from there
  size_t rewind_at = ~size_t{0};    // call of run_pass that revokes all, when half its units are there
  size_t time_up_at = ~size_t{0};   // call that ends without a result
  size_t late_at = ~size_t{0};      // call that takes kLate
  std::vector<std::vector<WorkUnit>> calls;
  std::map<Digest, Bytes> chunks;
};

constexpr std::chrono::seconds kLate(5);

class StubJob final : public FarmJob {
 public:
  StubJob(Stub& stub, const JobSpec& spec)
      : stub_(stub),
        layout_(spec.transport.basis, spec.transport.quantities),
        planes_(static_cast<uint32_t>(layout_.planes())) {}
  Digest add_chunk(Bytes bytes) override {
    const Digest id = sha256(bytes);
    stub_.chunks[id] = std::move(bytes);
    return id;
  }
  Expected<PassEnd> run_pass(std::vector<WorkUnit> units, int64_t, const PassHandlers& handlers) override {
    const size_t call = stub_.calls.size();
    stub_.calls.push_back(units);
    if (call == stub_.time_up_at) return PassEnd::kTimeUp;
    const size_t answered = call == stub_.rewind_at ? units.size() / 2 : units.size();
    for (size_t i = 0; i < answered; ++i) KILN_TRY_STATUS(handlers.on_result(units[i], answer(units[i])));
    if (call == stub_.late_at) std::this_thread::sleep_for(kLate);
    return call == stub_.rewind_at ? PassEnd::kRewound : PassEnd::kComplete;
  }
  FarmStatistics statistics() override { return {}; }

 private:
  UnitResult answer(const WorkUnit& unit) const {
    UnitResult r;
    r.unit = unit.id;
    r.site_count = static_cast<uint32_t>(unit.sites.size());
    r.plane_count = planes_;
    r.moments.assign(unit.sites.size() * planes_, 0.0);
    for (size_t i = 0; i < unit.sites.size(); ++i) {
      double* sums = &r.moments[i * planes_];
      for (uint32_t k = 0; k < unit.sample_count; ++k) {
        const double light = stub_.light(unit.sites[i], unit.replicate, unit.first_sample + k);
        for (size_t c = 0; c < 3; ++c) sums[kMomentER + c] += static_cast<double>(c + 1) * light;
        sums[kMomentLum] += light;
        sums[kMomentLum2] += light * light;
      }
      for (size_t k = 0; layout_.quantities().cache_draws && k < kCacheDraws; ++k)
        sums[layout_.cache_draws() + k] = drawn_of(unit, unit.sites[i]);
    }
    return r;
  }

  double drawn_of(const WorkUnit& unit, uint32_t site) const {
    if (site < stub_.drawn_from) return 0;
    return unit.sample_count * (stub_.calls.size() > stub_.drawn_until ? 0.25 : 1) * stub_.drawn;
  }

  Stub& stub_;
  const MomentLayout layout_;
  const uint32_t planes_;
};

double noisy(uint32_t site, uint32_t replicate, uint32_t sample) {
  return 2.0 * unit_float(static_cast<uint32_t>(
                   mix_bits((uint64_t{site} << 32 | sample) * kReplicates + replicate)));
}

// The order in which units are handed out is free.
std::vector<WorkUnit> by_number(std::vector<WorkUnit> units) {
  std::sort(units.begin(), units.end(), [](const WorkUnit& a, const WorkUnit& b) { return a.id < b.id; });
  return units;
}

class Passes : public testing::Test {
 protected:
  Passes() {
    test::write_scene_glb(test::small_room(), dir_.path() / "room.glb");
    request_.scene = dir_.path() / "room.glb";
    request_.pictures = false;
    request_.settings.layout = "pack";
    request_.settings.texels_per_metre = 3;
    request_.settings.denoise = false;
    request_.settings.cache = true;
    // As a farm answers that has begun the job before: how fast answers come must not matter here.
    request_.cut = [](uint32_t, uint32_t) { return 64u; };
  }
  BakeReport bake(Stub& stub) {
    request_.output = dir_.path() / ("out" + std::to_string(++count_));
    request_.open_job = [&](const JobSpec& spec, const ChunkStore&) -> Expected<std::unique_ptr<FarmJob>> {
      return std::make_unique<StubJob>(stub, spec);
    };
    const auto report = run_bake(request_, [](const auto&) {});
    if (!report) throw std::runtime_error(report.error().message);
    return *report;
  }
  static std::map<std::string, std::string> masters(const BakeReport& report) {
    std::map<std::string, std::string> out;
    for (const OutputFile& f : report.outputs)
      if (f.master) out[f.name] = f.digest.hex();
    return out;
  }

  static size_t sites_of(const std::vector<WorkUnit>& all) {
    size_t sites = 0;
    for (const WorkUnit& unit : all)
      if (unit.replicate == 0) sites += unit.sites.size();
    return sites;
  }

  // Passes whose samples are in no texel; they come first.
  static size_t dropped(const BakeReport& report) {
    size_t n = 0;
    while (n < report.passes.size() && !report.passes[n].kept) ++n;
    return n;
  }

  test::TempDir dir_;
  int count_ = 0;
  BakeRequest request_;
};

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
  request_.settings.min_samples = request_.settings.max_samples = 512;
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
  EXPECT_EQ(masters(report), masters(bake(dim)));
}

// What sites have whose error is that of the caches is dropped and taken again before the large passes.
TEST_F(Passes, SitesThatErrByTheirCachesBeginAgain) {
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 8192;
  request_.settings.error = 0.02;
  Stub stub;
  stub.light = noisy;
  stub.drawn = 0.03;
  const size_t sites = [&] {
    Stub first;
    first.light = noisy;
    bake(first);
    return sites_of(first.calls[0]);
  }();
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
}

TEST_F(Passes, ARewoundJobIsBakedAsIfForTheFirstTime) {
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 2000;
  request_.settings.error = 0.1;
  for (const bool cache : {false, true}) {
    request_.settings.cache = cache;
    Stub plain;
    plain.light = noisy;
    plain.drawn = 0.03;
    plain.drawn_until = 4;
    const BakeReport expected = bake(plain);
    ASSERT_GE(plain.calls.size(), 3u);
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
  const BakeReport a = bake(even), b = bake(rough), c = bake(noise);
  EXPECT_EQ(dropped(a), 2u);
  EXPECT_GT(dropped(b), 2u);
  EXPECT_EQ(dropped(c), 2u);
  for (const BakeReport* report : {&a, &b, &c}) EXPECT_EQ(report->passes.back().samples, 512);
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

TEST_F(Passes, LimitedTimeIsAllTakenUnlessAnErrorWasAskedFor) {
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 2000;
  request_.settings.source["max-samples"] = "test";
  request_.settings.error = 0.1;
  request_.settings.time_limit = 1e6;
  request_.settings.cache = false;
  Stub all, enough;
  all.light = enough.light = noisy;
  EXPECT_GT(bake(all).passes.back().samples, 1900);
  request_.settings.source["error"] = "test";
  const BakeReport report = bake(enough);
  EXPECT_LT(report.passes.back().samples, 1900);
  EXPECT_TRUE(report.complete);
}

// Texels at --max-samples are reported as held back by it, unless the bake would have raised it if there had
// been time.
TEST_F(Passes, OnlyABoundThatStandsHoldsTexelsBack) {
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 64;
  request_.settings.error = 1e-4;
  request_.settings.error_norm = "max";
  request_.settings.time_limit = 1e6;
  request_.settings.cache = false;
  Stub open, bound;
  open.light = bound.light = noisy;
  request_.settings.source["max-samples"] = "test";
  const BakeReport held = bake(bound);
  EXPECT_EQ(held.held_back, 1);
  EXPECT_TRUE(held.complete) << "more time would change nothing";
  request_.settings.source.erase("max-samples");
  open.late_at = bound.calls.size() - 1;
  request_.settings.time_limit = std::chrono::duration<double>(kLate).count();
  const BakeReport raised = bake(open);  // every texel is at the bound when the time is up
  EXPECT_EQ(raised.passes.back().samples, held.passes.back().samples);
  EXPECT_EQ(raised.held_back, 0);
  EXPECT_FALSE(raised.complete);
}

// Few samples allowed, and not even those taken everywhere.
TEST_F(Passes, TexelsWithoutASampleAreNotAtTheirBound) {
  request_.settings.min_samples = 2;
  request_.settings.max_samples = 2;
  request_.settings.source["max-samples"] = "test";
  request_.settings.time_limit = 1e6;
  request_.settings.cache = false;
  Stub stub;
  stub.light = noisy;
  stub.time_up_at = 1;  // after the first look
  const BakeReport report = bake(stub);
  EXPECT_GT(report.statement.never_sampled, 0);
  EXPECT_FALSE(report.complete);
}

TEST_F(Passes, WithoutTimeNothingIsDropped) {
  request_.settings.min_samples = 32;
  request_.settings.time_limit = 1e-3;  // gone before the first pass
  Stub stub;
  stub.light = noisy;
  const BakeReport report = bake(stub);
  ASSERT_FALSE(report.passes.empty());
  for (const PassPoint& pass : report.passes) EXPECT_TRUE(pass.kept);
  EXPECT_GT(report.texels_by_class[static_cast<size_t>(Validity::kMeasured)], 100u);
}

// The first looks, in the order they come: texels of each, and none of them twice.
TEST_F(Passes, ALimitedBakeLooksEverywhereFirst) {
  request_.settings.time_limit = 1e6;
  request_.settings.max_samples = 64;
  request_.settings.source["max-samples"] = "test";
  for (const bool cache : {false, true}) {
    request_.settings.cache = cache;
    Stub stub;
    stub.light = noisy;
    const BakeReport report = bake(stub);
    std::map<uint32_t, uint32_t> have;  // replicate 0
    size_t looks = 0;
    size_t last = 0;
    while (have.size() < report.plan.valid_texels) {
      ASSERT_LT(looks, 4u);
      std::set<uint32_t> sites;
      for (const WorkUnit& unit : stub.calls.at(looks))
        if (unit.replicate == 0)
          for (const uint32_t site : unit.sites) {
            EXPECT_EQ(unit.first_sample, 0u);
            EXPECT_EQ(unit.sample_count, 1u);
            EXPECT_TRUE(have.emplace(site, 1).second) << "a texel is looked at twice";
            sites.insert(site);
          }
      EXPECT_GT(sites.size(), last) << "finer and finer";
      last = sites.size();
      ++looks;
    }
    EXPECT_EQ(looks, 4u);
    // Then twice as many everywhere, and again.
    for (uint32_t count = 1; count < 8; count *= 2) {
      size_t sites = 0;
      for (const WorkUnit& unit : stub.calls.at(looks)) {
        EXPECT_EQ(unit.first_sample, count);
        EXPECT_EQ(unit.sample_count, count);
        EXPECT_EQ(unit.cache != Digest{}, cache) << "what was found is read";
        sites += unit.replicate == 0 ? unit.sites.size() : 0;
      }
      EXPECT_EQ(sites, have.size());
      ++looks;
    }
    EXPECT_EQ(report.statement.never_sampled, 0u);
  }
}

TEST_F(Passes, TooLittleTimeForEveryChartIsNoMap) {
  request_.settings.time_limit = 1e6;
  Stub stub;
  stub.light = noisy;
  stub.time_up_at = 0;
  request_.output = dir_.path() / "none";
  request_.open_job = [&](const JobSpec& spec, const ChunkStore&) -> Expected<std::unique_ptr<FarmJob>> {
    return std::make_unique<StubJob>(stub, spec);
  };
  const auto report = run_bake(request_, [](const auto&) {});
  ASSERT_FALSE(report);
  EXPECT_EQ(exit_status(report.error()), 4);
  EXPECT_NE(report.error().message.find("--time-limit"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(request_.output / "irradiance.exr"));
}

TEST_F(Passes, TexelsThatWereNeverSampledAreFilledAndCounted) {
  request_.settings.time_limit = 1e6;
  for (const bool denoise : {false, true}) {
    request_.settings.denoise = denoise;
    Stub stub;
    stub.light = [](uint32_t, uint32_t, uint32_t) { return 1.0; };
    stub.time_up_at = 2;
    const BakeReport report = bake(stub);
    EXPECT_FALSE(report.complete);
    EXPECT_GT(report.statement.never_sampled, report.plan.valid_texels / 2);
    EXPECT_LT(report.statement.never_sampled, report.plan.valid_texels);
    // Light is the same everywhere, so it must be so where it was guessed: 0 texels are black or without
    // value.
    EXPECT_EQ(report.texels_by_class[static_cast<size_t>(Validity::kFilled)] +
                  report.texels_by_class[static_cast<size_t>(Validity::kMeasured)],
              report.owned_texels);
    EXPECT_LT(report.statement.within_target, 0.5);
  }
}

TEST_F(Passes, ABakeThatRanOutOfTimeSaysSo) {
  request_.settings.min_samples = 32;
  request_.settings.max_samples = 2000;
  request_.settings.error = 0.1;
  Stub stub;
  stub.light = noisy;
  stub.time_up_at = 3;
  EXPECT_FALSE(bake(stub).complete);
  EXPECT_EQ(stub.calls.size(), 4u);  // nothing is asked for after
}

}  // namespace
}  // namespace kiln
