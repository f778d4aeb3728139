// Error against run time and against rays, for chosen settings: bakes every configuration at every budget of
// its ladder, several times, and holds each against one reference.
#pragma once

#include "coordinator/measure/bench/curve.h"
#include "coordinator/measure/bench/measure.h"

namespace kiln {

struct BenchRequest {
  std::filesystem::path scene, output;  // `output` takes bench.json, bench.csv, bench.svg and bench.png
  std::filesystem::path references;
  std::filesystem::path worker_program;
  BakeSettings settings;
  std::vector<Configuration> configurations;
  std::vector<double> errors, samples;  // budgets, from cheap to dear
  uint32_t repeats = 3;
  uint32_t reference_samples = 16384;
  double reference_share = 1;  // of the texels, in blocks
  bool reference_cache = false;
  double most_seconds = 120;  // a run beyond this is the last of its ladder
};

// What curves are asked for.
constexpr double kTargets[] = {1e-3, 1e-4};
// A ladder ends below this: nobody asks for less, and the reference is not meant for it.
constexpr double kGoodEnough = 2.5e-5;

struct BenchCurve {
  std::string configuration;
  std::vector<CurvePoint> points;  // in the order of the budgets
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
  std::vector<BenchRun> runs;    // in the order they were made
  std::vector<BenchCurve> curves;
};

// Runs take turns, one repeat of all configurations after the other, so that other work on the machine meets
// all. A repeat has a seed of its own. `note` is told of every run.
Expected<BenchResult> run_bench(const BenchRequest& request,
                                const std::function<void(const BakeProgress&)>& progress,
                                const std::function<void(const std::string&)>& note);

// Medians and crossings of the runs, in the order in which configurations and budgets occur.
std::vector<BenchCurve> curves_of(const std::vector<BenchRun>& runs);

}  // namespace kiln
