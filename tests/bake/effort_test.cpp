// How much is sampled where the count is fixed, and what a bake says whose time is up before its error is
// reached. How long anything takes is not looked at.
#include <cmath>
#include <functional>

#include "coordinator/run/bake_run.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

class Effort : public testing::Test {
 protected:
  Effort() {
    test::write_scene_glb(test::small_room(), dir_.path() / "room.glb");
    request_.scene = dir_.path() / "room.glb";
    request_.output = dir_.path() / "out";
    request_.worker_program = test::binary_dir() / "bin/kiln-worker";
    request_.settings.layout = "pack";
    request_.settings.texels_per_metre = 3;
    request_.settings.workers = request_.settings.threads = 1;
  }
  BakeReport bake() {
    const auto report = run_bake(request_, [](const auto&) {});
    if (!report) throw std::runtime_error(report.error().message);
    return *report;
  }

  // A bake with a time limit: the shortest of 3, 6, 12 ... 96 s that is enough for `is_enough`, however busy
  // the machine is.
  BakeReport bake_limited(const std::function<bool(const BakeReport&)>& is_enough) {
    for (request_.settings.time_limit = 3;; request_.settings.time_limit *= 2) {
      auto report = run_bake(request_, [](const auto&) {});
      const bool is_last = request_.settings.time_limit >= 96;
      if (report && (is_last || is_enough(*report))) return *std::move(report);
      if (!report && (is_last || report.error().kind != ErrorKind::kTooShort))
        throw std::runtime_error(report.error().message);
    }
  }

  static size_t measured(const BakeReport& r) {
    return r.texels_by_class[static_cast<size_t>(Validity::kMeasured)];
  }

  test::TempDir dir_;
  BakeRequest request_;
};

TEST_F(Effort, AFixedCountIsKept) {
  for (const bool cache : {false, true}) {
    request_.settings.min_samples = request_.settings.max_samples = 48;
    request_.settings.cache = cache;
    const BakeReport report = bake();
    ASSERT_FALSE(report.passes.empty());
    // The pass of whole paths, which is dropped, comes first. A round after it would take a third of 48.
    EXPECT_EQ(report.passes.size(), cache ? 2u : 1u);
    EXPECT_DOUBLE_EQ(report.passes.back().samples, 48) << "cache " << cache;
    EXPECT_TRUE(report.complete);
  }
}

TEST_F(Effort, NoTexelHasMoreThanTheMost) {
  request_.settings.min_samples = 16;
  request_.settings.max_samples = 200;
  request_.settings.error = 1e-4;  // out of reach
  const BakeReport report = bake();
  EXPECT_LE(report.passes.back().samples, 200);
  EXPECT_GT(report.passes.back().samples, 150);  // all but black texels have all
  for (size_t i = 1; i < report.passes.size(); ++i) {
    EXPECT_GE(report.passes[i].samples, report.passes[i - 1].samples);
    EXPECT_GE(report.passes[i].rays, report.passes[i - 1].rays);
  }
}

TEST_F(Effort, ABakeOfLimitedTimeIsWholeAndSaysItsError) {
  for (const bool cache : {false, true}) {
    request_.settings.error = 1e-5;  // out of reach
    request_.settings.source["error"] = "test";
    request_.settings.max_samples = 1 << 30;
    request_.settings.cache = request_.settings.denoise = cache;
    const BakeReport report =
        bake_limited([](const BakeReport& r) { return !r.passes.empty() && measured(r) > 100; });
    EXPECT_FALSE(report.complete);
    EXPECT_EQ(report.unmet, "");
    ASSERT_FALSE(report.passes.empty());
    const PassPoint& end = report.passes.back();
    EXPECT_GT(end.rms_relative, 0);
    EXPECT_TRUE(std::isfinite(end.worst_relative));
    EXPECT_GE(end.worst_relative, end.rms_relative);
    EXPECT_LT(end.converged_share, 1);
    for (const OutputFile& f : report.outputs)
      EXPECT_TRUE(std::filesystem::exists(request_.output / f.name)) << f.name;
    EXPECT_GT(measured(report), 100u);
  }
}

TEST_F(Effort, OnlyABoundThatWasGivenHoldsALimitedBake) {
  const auto is_more = [](const BakeReport& r) { return r.passes.back().samples > 64; };
  request_.settings.cache = false;
  request_.settings.max_samples = 64;  // stands for the default
  EXPECT_TRUE(is_more(bake_limited(is_more)));
  request_.settings.source["max-samples"] = "test";
  EXPECT_FALSE(is_more(bake_limited([](const BakeReport&) { return true; })));
}

}  // namespace
}  // namespace kiln
