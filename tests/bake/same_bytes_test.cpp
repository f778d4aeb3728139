// The promise of equal bytes: whatever the number of workers, the size of tiles, deaths, silences and
// repeated answers, the master files have the same digests.
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <map>
#include <set>

#include "coordinator/run/bake_run.h"
#include "tests/bake/scene_gltf.h"
#include "tests/bake/worker_processes.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

// With whole paths alone, and with what rests on passes before: caches that later units name, and the
// denoiser.
class SameBytes : public testing::TestWithParam<bool> {
 protected:
  SameBytes() { test::write_scene_glb(test::small_room(), dir_.path() / "room.glb"); }

  BakeRequest request() {
    BakeRequest r;
    r.scene = dir_.path() / "room.glb";
    r.output = dir_.path() / ("out" + std::to_string(++count_));
    r.worker_program = test::binary_dir() / "bin/kiln-worker";
    r.settings.layout = "pack";
    r.settings.texels_per_metre = 4;
    r.settings.min_samples = 32;
    r.settings.max_samples = 3000;  // beyond one range of samples
    r.settings.error = 0.08;
    r.settings.workers = 1;
    r.settings.threads = 1;
    r.settings.cache = r.settings.denoise = GetParam();
    if (GetParam()) r.settings.quantities = *parse_quantities("light,ao,sky,bent");
    r.settings.tile_texels = 8;  // many units, so that faults fall between them
    return r;
  }

  static std::map<std::string, std::string> digests(const BakeReport& report) {
    std::map<std::string, std::string> out;
    for (const OutputFile& f : report.outputs)
      if (f.master) out[f.name] = f.digest.hex();
    return out;
  }

  static std::string events(const BakeReport& report) {
    std::string all;
    for (const std::string& event : report.farm.events) all += event + "\n";
    return all;
  }

  std::map<std::string, std::string> bake(
      const BakeRequest& r, BakeReport* out = nullptr,
      const std::function<void(const BakeProgress&)>& progress = [](const auto&) {}) {
    const auto report = run_bake(r, progress);
    EXPECT_TRUE(report) << (report ? "" : report.error().message);
    if (!report) return {};
    if (out) *out = *report;
    return digests(*report);
  }

  const std::map<std::string, std::string>& reference() {
    if (reference_.empty()) reference_ = bake(request());
    // irradiance, sh_l1, error and by band, samples, validity, two of charts; before the filter, and three
    // responses with their errors
    EXPECT_EQ(reference_.size(), GetParam() ? 15u : 8u);
    return reference_;
  }

  // Signals one of so many workers once, when all have joined and a share of the first long pass is done.
  std::function<void(const BakeProgress&)> once(int signal, std::atomic<pid_t>& victim, size_t joined) {
    return [signal, joined, &victim](const BakeProgress& p) {
      if (victim != 0 || p.stage != "bake" || p.pass < 2 || p.workers < joined) return;
      // One that has not begun a unit yet would not be missed.
      const pid_t busiest = test::busiest_worker();
      if (busiest == 0) return;
      victim = busiest;
      ::kill(victim, signal);
    };
  }

  test::TempDir dir_;
  int count_ = 0;
  std::map<std::string, std::string> reference_;
};

TEST_P(SameBytes, RunTwice) {
  EXPECT_EQ(bake(request()), reference());
}

TEST_P(SameBytes, AnotherSeedDiffers) {
  BakeRequest r = request();
  r.settings.seed = 1;
  EXPECT_NE(bake(r), reference());
}

TEST_P(SameBytes, TwoAndFiveWorkers) {
  for (uint32_t workers : {2u, 5u}) {
    BakeRequest r = request();
    r.settings.workers = workers;
    EXPECT_EQ(bake(r), reference()) << workers << " workers";
  }
}

TEST_P(SameBytes, ThreadsAndTileSizes) {
  BakeRequest r = request();
  r.settings.threads = 3;
  r.settings.tile_texels = 1;
  EXPECT_EQ(bake(r), reference());
  r = request();
  r.settings.tile_texels = 5000;
  EXPECT_EQ(bake(r), reference());
}

TEST_P(SameBytes, OneWorkerKilled) {
  BakeRequest r = request();
  r.settings.workers = 2;
  std::atomic<pid_t> victim = 0;
  BakeReport report;
  EXPECT_EQ(bake(r, &report, once(SIGKILL, victim, 2)), reference());
  EXPECT_NE(victim, 0);
  EXPECT_GE(report.farm.workers_lost, 1u);
}

TEST_P(SameBytes, TheOnlyWorkerKilled) {
  std::atomic<pid_t> victim = 0;
  BakeReport report;
  EXPECT_EQ(bake(request(), &report, once(SIGKILL, victim, 1)), reference());
  EXPECT_NE(victim, 0);
  EXPECT_GE(report.farm.workers_lost, 1u);
  EXPECT_GE(report.farm.reassigned, 1u);
}

TEST_P(SameBytes, OneWorkerStopped) {
  BakeRequest r = request();
  r.settings.workers = 2;
  r.settings.lease_ms = 500;
  std::atomic<pid_t> victim = 0;
  BakeReport report;
  EXPECT_EQ(bake(r, &report, once(SIGSTOP, victim, 2)), reference());
  EXPECT_NE(victim, 0);
  // It was found silent when its lease had run out, or before that the other worker answered all its units,
  // copied because they were late.
  EXPECT_TRUE(report.farm.copies + report.farm.reassigned > 0 ||
              events(report).find("silent") != std::string::npos)
      << events(report);
}

TEST_P(SameBytes, EveryUnitAnsweredTwice) {
  BakeRequest r = request();
  r.settings.workers = 2;
  r.quorum = 2;
  BakeReport report;
  EXPECT_EQ(bake(r, &report), reference());
  EXPECT_GE(report.farm.duplicates, report.farm.units / 2);
}

TEST_P(SameBytes, NoWorkerProcessIsLeft) {
  reference();
  EXPECT_TRUE(test::worker_processes().empty());
}

INSTANTIATE_TEST_SUITE_P(, SameBytes, testing::Bool(), [](const auto& kind) {
  return kind.param ? std::string("CachedAndDenoised") : std::string("WholePaths");
});

}  // namespace
}  // namespace kiln
