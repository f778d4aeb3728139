// --two-pass: a short first pass over the whole layout, then a layout without the texels that it has shown to
// be of no use.
#pragma once

#include "common/base/clock.h"
#include "coordinator/bake/collapse/judge.h"
#include "coordinator/bake/sampling/texel_errors.h"
#include "coordinator/run/workplace.h"

namespace kiln {

// Samples of every texel in each replicate, always as many: what they decide must not depend on who baked
// them, nor on how fast. They are of whole paths, in a sequence of their own, and in no texel of the map.
constexpr uint32_t kFirstPassSamples = 16;
constexpr uint32_t kFirstPassSteps = 2;  // at most: with caches, once more from what they hold

struct TwoPassTask {
  const BakeRequest& request;
  Workplace& workplace;
  const Stopwatch& watch;  // began with the bake
  BakeReport& report;      // gets two_pass, stages and notes
  const std::function<void(const BakeProgress&)>& progress;
  std::function<Status()> may_go_on;  // asked while the second layout is made
};

// Bakes the first pass of `preflight`, and lays out again where charts may collapse: `preflight` is then that
// layout. Returns what is known of its charts by placement: empty, nothing. Where the layout is the file's
// own, or the time limit leaves no time for it, there is no first pass, and a note says so.
Expected<std::vector<ChartLight>> lay_out_by_light(const TwoPassTask& task, Preflight& preflight);

// Numbers of units of a pass over that layout begin above this: results of another layout that a farm has
// kept under the same job are never taken for them. `pass`: 0, the first pass; 1, those of the map.
uint64_t units_before(const Digest& atlas, uint32_t pass);

// What a chart's one value is wrong by is stated with the noise: sqrt(noise^2 + deviation^2) of the texels of
// charts that collapsed because they are evenly lit.
void state_deviations(const Atlas& atlas, std::span<const ChartLight> light, TexelErrors& errors);
// The same in the planes of the map: error, and those of bands.
void state_deviations(const Atlas& atlas, std::span<const ChartLight> light, const BasisInfo& basis,
                      Lightmap& map);

}  // namespace kiln
