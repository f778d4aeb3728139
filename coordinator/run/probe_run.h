// Bakes the probes of a bake: a job of its own on the same farm, with the same replicates, schedule and rule
// when to stop as the map's, before the map.
#pragma once

#include "common/base/parallel.h"
#include "common/probes/field.h"
#include "coordinator/run/workplace.h"
#include "coordinator/scene/probes/probes.h"

namespace kiln {

struct BakedProbes {
  ProbeLayout layout;
  ProbeField field;
};

struct ProbeTask {
  const BakeRequest& request;
  const Preflight& preflight;
  Workplace& workplace;
  const Stopwatch& watch;  // started with the bake
  BakeReport& report;      // receives probes, stages and warnings
  const std::function<void(const BakeProgress&)>& progress;
};

// The volumes that the settings and the scene ask for; empty: no probes are asked for.
Expected<std::vector<ProbeBox>> probe_boxes(const ImportResult& imported, const BakeSettings& settings);
// Lays them out. `settings` decide how many there may be; fails where `memory`, in bytes, holds fewer.
Expected<std::optional<ProbeLayout>> plan_probes(const ImportResult& imported, const BakeSettings& settings,
                                                 uint64_t memory = memory_bytes());

struct ProbeFileWish;
// --probe-files.
ProbeFileWish probe_files_of(const BakeSettings& settings);

// Bytes of the coordinator for each probe, while it is baked and after.
uint64_t probe_bytes(bool visibility);

// What `kiln plan` says of a layout.
ProbePlan describe_probes(const ProbeLayout& layout, const BakeSettings& settings);

// Of preflight.probes, which exist.
Expected<BakedProbes> bake_probes(const ProbeTask& task);

// Publishes a bake of probes alone.
Status publish_probes(const ProbeTask& task, const BakedProbes& probes);

}  // namespace kiln
