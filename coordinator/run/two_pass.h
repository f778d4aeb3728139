// --two-pass: a short first pass over the whole layout, then a second layout without the texels
// that it found to be superfluous.
#pragma once

#include "common/base/clock.h"
#include "coordinator/bake/collapse/judge.h"
#include "coordinator/bake/sampling/texel_errors.h"
#include "coordinator/run/workplace.h"

namespace kiln {

// Samples per texel and replicate, always the same number: decisions must not depend on who baked them, nor
// how fast. They are whole paths with a random sequence of their own, and are not part of the map.
constexpr uint32_t kFirstPassSamples = 16;
constexpr uint32_t kFirstPassSteps = 2;  // at most: with caches, once more reading them

struct TwoPassTask {
  const BakeRequest& request;
  Workplace& workplace;
  const Stopwatch& watch;  // started with the bake
  BakeReport& report;      // receives two_pass, stages and notes
  const std::function<void(const BakeProgress&)>& progress;
  std::function<Status()> may_go_on;  // called while the second layout is made
};

// Bakes the first pass of `preflight` and, if charts collapse, replaces `preflight` by the new
// layout. Returns what is known about its charts by placement, or empty. If the layout is the
// file's own, or there is no time for it, there is no first pass, and a note says so.
Expected<std::vector<ChartLight>> lay_out_by_light(const TwoPassTask& task, Preflight& preflight);

// Unit numbers of a pass over that layout start above this, so results of another layout that a farm kept
// under the same job are never mistaken for them. `pass`: 0 for the first pass, 1 for the map's.
uint64_t units_before(const Digest& atlas, uint32_t pass);

// The error of a chart's single value is reported with the noise: sqrt(noise^2 + deviation^2) for
// texels of charts that collapsed because they are evenly lit.
void state_deviations(const Atlas& atlas, std::span<const ChartLight> light, TexelErrors& errors);
// The same for the error planes of the map, including those of bands.
void state_deviations(const Atlas& atlas, std::span<const ChartLight> light, const BasisInfo& basis,
                      Lightmap& map);

}  // namespace kiln
