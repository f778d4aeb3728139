// Runs passes until every texel meets the target error, has its maximum samples, or time is up.
//
// With irradiance caches, the first pass traces whole paths; paths of the second end at its irradiance. Each
// texel of the second has gathered from all others, so its light is even rather than noisy, and the lasting
// passes start from it. The samples of the first two are dropped: whole paths are noisier than their
// replacements, and the error of the first cache is shared by all texels that see it.
#pragma once

#include "coordinator/bake/denoise/coarse.h"
#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/sampling/texel_errors.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/run/time_budget.h"

namespace kiln {

// The surface that the denoiser filters over; empty if it is off.
struct SurfaceGraph {
  SiteGeometry sites;
  SurfaceLinks links;
};

struct BakingTask {
  const BakeRequest& request;
  const Preflight& preflight;
  const SurfaceGraph* surface;  // null: no denoising, errors are those of single texels
  TimeBudget& budget;
  FarmJob& farm;
  Accumulator& sums;   // empty on entry; receives the samples that last
  BakeReport& report;  // receives passes, warnings, non-finite samples, completeness
  const std::function<void(const BakeProgress&)>& progress;
  // Set if another layout of the same job was baked before: passes and units are numbered from here.
  uint32_t passes_before = 0;
  uint64_t units_before = 0;
  // By site: 1 where the mean over the texel misleads; no path ends there (misleading_sites). Empty: nowhere.
  std::vector<uint8_t> misleading = {};
};
struct Baked {
  TexelErrors errors;                  // of light; without light, of the first response
  std::vector<TexelErrors> responses;  // in the order of the job's responses
  std::vector<float> shared;           // by site: TexelStatistics::shared; empty without caches
  KeptFilters filters;                 // of the last pass, if it was filtered
  double unmet = 0;                    // UnmetLight::get()
  bool whole = true;                   // false: time was up before every chart had a sample
};
Expected<Baked> bake_passes(const BakingTask& task);

}  // namespace kiln
