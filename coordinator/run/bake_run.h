// The conductor: the one place that lists the stages of a bake.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "common/job/settings.h"
#include "coordinator/farm/dispatch/farm.h"
#include "coordinator/report/plan_page.h"
#include "coordinator/report/report.h"
#include "coordinator/scene/probes/probes.h"

namespace kiln {

struct BakeProgress {
  std::string stage;  // the current stage
  double done = 0;    // share of the current stage, 0 to 1
  uint32_t pass = 0;  // counted from 1; the total is not known in advance
  uint64_t rays = 0;
  double rays_per_second = 0;
  double seconds_left = -1;    // predicted time to the end; -1: unknown
  double converged_share = 0;  // share of texels, after the last pass
  uint32_t workers = 0;
};

struct BakeRequest {
  std::filesystem::path scene, output;
  BakeSettings settings;
  std::filesystem::path worker_program;  // kiln-worker
  // Number of workers that must agree on every unit. On one machine, more than one is for tests.
  uint32_t quorum = 1;
  // Opens the job on a shared farm. Empty: this bake starts its own farm on this machine.
  std::function<Expected<std::unique_ptr<FarmJob>>(const JobSpec&, const ChunkStore&)> open_job;
  // Texels per unit of a pass, given the number this run would choose: a farm returns what an
  // earlier run of the job chose, so that unit ids stay the same. Empty: this run's choice.
  std::function<Expected<uint32_t>(uint32_t pass, uint32_t chosen)> cut;
  // Selects the texels to sample, given an index into Atlas::owner and the width of the atlas. Empty: all.
  // For references of large maps, without caches and denoiser; other texels are treated as having no site.
  std::function<bool(uint32_t texel, uint32_t width)> sampled;
  bool pictures = true;  // make the report's pictures (preview, validity, densities) and report.html
  const std::atomic<bool>* cancelled = nullptr;  // checked between stages; if set, the bake fails
};

// Bakes and publishes. On failure nothing half-written is left in the output folder. If the
// report's `unmet` is not empty, the masters are complete but the bake has failed.
Expected<BakeReport> run_bake(const BakeRequest& request,
                              const std::function<void(const BakeProgress&)>& progress);

// Everything before the first ray: for `kiln plan`. `may_go_on`: as in AtlasSettings.
struct Preflight {
  ImportResult imported;
  Atlas atlas;
  Projection projection;  // projection of imported.display
  Plan plan;
  std::optional<ProbeLayout> probes;  // if any are asked for
  std::string kept_layout;            // SHA-256 of the --keep-layout file; empty: none
  size_t import_notes = 0;            // number of imported.notes made before the layout; they come first
  bool unseen_decides = true;         // false: --unseen auto has no camera or light to decide by
  PlanView view() const { return {imported, atlas, plan, projection}; }
};
// Parts of the layout that are fixed by the caller. Layout pack.
struct LayoutWish {
  // Like AtlasSettings::collapse, replacing the result of --unseen. Empty: use --unseen.
  std::function<std::vector<uint8_t>(const ChartsToSize&)> collapse;
  float texels_per_metre = 0;  // if positive, replaces the settings' density and --max-texels
};
Expected<Preflight> run_preflight(const std::filesystem::path& scene, const BakeSettings& settings,
                                  std::vector<StageTime>& times,
                                  const std::function<void(const BakeProgress&)>& progress,
                                  const std::function<Status()>& may_go_on = {}, const LayoutWish& wish = {});
// Redoes everything but the import, replacing the layout. `preflight.atlas` may have been moved from.
Status lay_out_again(const std::filesystem::path& scene, const BakeSettings& settings, const LayoutWish& wish,
                     Preflight& preflight, std::vector<StageTime>& times,
                     const std::function<void(const BakeProgress&)>& progress,
                     const std::function<Status()>& may_go_on);

// Writes plan.html, plan.json and, unless --preview is off, density.png and, where there are probes,
// probes.png into a folder, created if needed.
Status write_plan(const std::filesystem::path& scene, const Preflight& preflight,
                  const BakeSettings& settings, const std::filesystem::path& folder);

}  // namespace kiln
