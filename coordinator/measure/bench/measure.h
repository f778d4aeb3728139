// One bake, its cost and its error.
#pragma once

#include "coordinator/measure/bench/ladder.h"
#include "coordinator/measure/bench/reference.h"
#include "coordinator/measure/compare/measures.h"

namespace kiln {

struct BenchRun {
  std::string configuration, budget;
  double budget_value = 0;
  uint32_t repeat = 0;
  double total_seconds = 0;  // the whole bake, including import and files
  double seconds = 0;        // from the first unit to the finished map, without files
  double core_seconds = 0;   // over all worker threads
  uint64_t rays = 0, texels = 0;
  bool complete = true;  // false: stopped by the time limit
  Comparison comparison;
  std::vector<std::pair<std::string, std::string>> settings;  // non-default ones
};

struct MeasureRequest {
  std::filesystem::path scene, folder;  // `folder` receives the bake's files and is removed afterwards
  std::filesystem::path worker_program;
  BakeSettings settings;
};

// Leaves names and budget to the caller.
Expected<BenchRun> measure_run(const MeasureRequest& request, const Reference& reference,
                               const std::function<void(const BakeProgress&)>& progress);

// Seconds of the stages that make the map: from "bake" up to those that write files ("textures").
double map_seconds(const std::vector<StageTime>& stages);

}  // namespace kiln
