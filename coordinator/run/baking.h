// Pass after pass until every texel is as good as was asked for, has its most samples, or time is up.
//
// With irradiance caches: a first pass of whole paths, whose irradiance the second pass's paths end at; what
// the second finds is better lit evenly than noisy (each texel has gathered from all others) and is what the
// lasting passes begin with. The samples of the first two are dropped: whole paths are noisier than what they
// are replaced by, and the error of the first cache is shared by all texels that see it.
#pragma once

#include "coordinator/bake/denoise/coarse.h"
#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/sampling/texel_errors.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/run/time_budget.h"

namespace kiln {

// The surface that the denoiser walks; empty where it is off.
struct SurfaceGraph {
  SiteGeometry sites;
  SurfaceLinks links;
};

struct BakingTask {
  const BakeRequest& request;
  const Preflight& preflight;
  const SurfaceGraph* surface;  // null: texels are not denoised, and stated by themselves
  TimeBudget& budget;
  FarmJob& farm;
  Accumulator& sums;   // empty; filled with what lasts
  BakeReport& report;  // gets passes, warnings, non-finite samples, completeness
  const std::function<void(const BakeProgress&)>& progress;
  // Of another layout under the same job: passes are cut, and units numbered, from here on.
  uint32_t passes_before = 0;
  uint64_t units_before = 0;
};
struct Baked {
  TexelErrors errors;                  // of light; without light, of the first response
  std::vector<TexelErrors> responses;  // in the order of the job's
  // By site, relative: what its chart's light was wrong by in the first irradiance cache (chart_errors);
  // empty without one.
  std::vector<float> first_cache_error;
  bool whole = true;  // false: time was up before every chart had a sample
};
Expected<Baked> bake_passes(const BakingTask& task);

}  // namespace kiln
