// Error against run time and against rays: bakes every configuration at every budget of its ladder,
// several times, and compares each with one reference.
#pragma once

#include "coordinator/measure/bench/curve.h"
#include "coordinator/measure/bench/measure.h"

namespace kiln {

struct BenchRequest {
  std::filesystem::path scene, output;  // `output` receives bench.json, bench.csv, bench.svg and bench.png
  std::filesystem::path references;
  std::filesystem::path worker_program;
  BakeSettings settings;
  std::vector<Configuration> configurations;
  std::vector<double> errors, samples;  // budgets, from cheap to expensive
  uint32_t repeats = 3;
  uint32_t reference_samples = 16384;
  double reference_share = 1;  // share of the texels, in blocks
  bool reference_cache = false;
  double reference_error = 0;  // ReferenceRequest::error
  double most_seconds = 120;   // a longer run is the last of its ladder
};

// Errors at which curves are compared.
constexpr double kTargets[] = {1e-3, 1e-4};
// A ladder ends below this: users do not need less, and the reference is not accurate enough for it.
constexpr double kGoodEnough = 2.5e-5;

struct BenchCurve {
  std::string configuration;
  std::vector<CurvePoint> points;  // in budget order
  Crossing seconds[2], rays[2];    // at kTargets
};

struct BenchResult {
  std::string scene, machine;
  uint64_t texels = 0;
  std::string reference_key;
  std::filesystem::path reference_folder;
  uint32_t reference_samples = 0;
  double reference_share = 1;
  bool reference_reused = false;
  double reference_rel_mse = 0;  // of the mean of its halves: its own noise
  std::vector<BenchRun> runs;    // in execution order
  std::vector<BenchCurve> curves;
};

// Runs alternate: one repeat of all configurations, then the next, so that other load on the
// machine affects all. Each repeat has its own seed. `note` is called for every run.
Expected<BenchResult> run_bench(const BenchRequest& request,
                                const std::function<void(const BakeProgress&)>& progress,
                                const std::function<void(const std::string&)>& note);

// Medians and crossings of the runs, in the order in which configurations and budgets appear.
std::vector<BenchCurve> curves_of(const std::vector<BenchRun>& runs);

}  // namespace kiln
