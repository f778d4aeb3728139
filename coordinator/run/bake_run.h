// The conductor: the one place that lists the stages of a bake.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>

#include "common/job/settings.h"
#include "coordinator/farm/dispatch/farm.h"
#include "coordinator/report/plan_page.h"
#include "coordinator/report/report.h"

namespace kiln {

struct BakeProgress {
  std::string stage;  // what is being done
  double done = 0;    // share of the present stage, 0 to 1
  uint32_t pass = 0;  // counted from 1; how many there will be shows on the way
  uint64_t rays = 0;
  double rays_per_second = 0;
  double seconds_left = -1;    // of baking, as foretold; -1: not known yet
  double converged_share = 0;  // of the texels, after the last pass
  uint32_t workers = 0;
};

struct BakeRequest {
  std::filesystem::path scene, output;
  BakeSettings settings;
  std::filesystem::path worker_program;  // kiln-worker
  // Workers that must agree on every unit. On one machine more than one is for tests.
  uint32_t quorum = 1;
  // Units of this job are handed out by a farm that others share. Empty: a farm of its own on this machine.
  std::function<Expected<std::unique_ptr<FarmJob>>(const JobSpec&, const ChunkStore&)> open_job;
  // How many texels a unit of a pass should have, given what this run would choose: a farm answers with what
  // an earlier run of the job chose, so that ids of units stay. Empty: as this run chooses.
  std::function<Expected<uint32_t>(uint32_t pass, uint32_t chosen)> cut;
  // Texels that are sampled: an index into Atlas::owner, and the width of the atlas. Empty: all. For
  // references of large maps, without caches and denoiser; others stay as without a site.
  std::function<bool(uint32_t texel, uint32_t width)> sampled;
  bool pictures = true;  // of the report: preview, validity, densities, and the page that shows them
  const std::atomic<bool>* cancelled = nullptr;  // looked at between stages: the bake then fails
};

// Bakes and publishes. On failure nothing half-written is left in the output folder. A report whose `unmet`
// says something is of a bake whose masters are whole and that has failed all the same.
Expected<BakeReport> run_bake(const BakeRequest& request,
                              const std::function<void(const BakeProgress&)>& progress);

// The part before any ray: for `kiln plan`. `may_go_on`: as of AtlasSettings.
struct Preflight {
  ImportResult imported;
  Atlas atlas;
  Projection projection;  // of imported.display
  Plan plan;
  std::string kept_layout;     // SHA-256 of the file of --keep-layout; empty: none
  size_t import_notes = 0;     // of imported.notes: those from before the layout come first
  bool unseen_decides = true;  // false: --unseen auto has nothing to go by
  PlanView view() const { return {imported, atlas, plan, projection}; }
};
// What of the layout is known and needs no asking. Layout pack.
struct LayoutWish {
  // As AtlasSettings::collapse, in the place of what --unseen finds. Empty: that.
  std::function<std::vector<uint8_t>(const ChartsToSize&)> collapse;
  float texels_per_metre = 0;  // above 0: in the place of that of the settings and of --max-texels
};
Expected<Preflight> run_preflight(const std::filesystem::path& scene, const BakeSettings& settings,
                                  std::vector<StageTime>& times,
                                  const std::function<void(const BakeProgress&)>& progress,
                                  const std::function<Status()>& may_go_on = {}, const LayoutWish& wish = {});
// All of that but the import, in the place of the layout that is there. `preflight.atlas` may be moved from.
Status lay_out_again(const std::filesystem::path& scene, const BakeSettings& settings, const LayoutWish& wish,
                     Preflight& preflight, std::vector<StageTime>& times,
                     const std::function<void(const BakeProgress&)>& progress,
                     const std::function<Status()>& may_go_on);

// plan.html, plan.json and, unless --preview is off, density.png into a folder, made if needed.
Status write_plan(const std::filesystem::path& scene, const Preflight& preflight,
                  const BakeSettings& settings, const std::filesystem::path& folder);

}  // namespace kiln
