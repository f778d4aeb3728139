// Passes within a time limit: what is looked at first, how the time is used, and what is said when it is up.
#include <set>

#include "tests/bake/stub_farm.h"

namespace kiln {
namespace {

using test::kLate;
using test::noisy;
using test::Stub;
using test::StubJob;
using Passes = test::Passes;

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

// The first looks end at caches of single samples, whose error a room hands on. Where whole paths take little
// of the time, caches begin again from these, and nothing of the looks stays.
TEST_F(Passes, ALimitedBakeBeginsAgainWithWholePathsWhereThereIsTime) {
  request_.settings.time_limit = 1e6;
  request_.settings.max_samples = 512;
  request_.settings.source["max-samples"] = "test";
  const auto whole_passes = [](const Stub& stub) {  // but for the first look
    size_t count = 0;
    for (size_t call = 1; call < stub.calls.size(); ++call)
      count += stub.calls[call].front().cache == Digest{};
    return count;
  };
  Stub quick, slow;
  quick.light = slow.light = noisy;
  const BakeReport report = bake(quick);
  ASSERT_EQ(whole_passes(quick), 1u);
  size_t at = 1;
  while (quick.calls[at].front().cache != Digest{}) ++at;
  EXPECT_EQ(sites_of(quick.calls[at]), report.plan.valid_texels);
  for (const WorkUnit& unit : quick.calls[at]) {
    EXPECT_EQ(unit.first_sample, 0u);
    EXPECT_EQ(unit.take, 1u) << "its samples are not those of the looks";
  }
  for (size_t call = at + 1; call < quick.calls.size(); ++call)
    for (const WorkUnit& unit : quick.calls[call]) EXPECT_GT(unit.take, 1u);
  // A tenth of the time for a pass of 16 samples in each replicate.
  slow.seconds =
      0.1 * request_.settings.time_limit / (2.0 * 16 * static_cast<double>(report.plan.valid_texels));
  bake(slow);
  EXPECT_EQ(whole_passes(slow), 0u);
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
