// The stages of a bake that bake_run.cpp lists, from the surface to the published files.
#pragma once

#include <optional>

#include "coordinator/run/baking.h"
#include "coordinator/run/two_pass.h"

namespace kiln {

// What the stages of one bake share.
struct BakeRun {
  const BakeRequest& request;
  const Stopwatch& watch;  // began with the bake
  const std::function<void(const BakeProgress&)>& progress;
  BakeReport& report;
  const Preflight& preflight;
  TimeBudget& budget;
  SeamFinder& seams;
};

// The surface that the denoiser walks, with the links of texels that see the same.
SurfaceGraph find_surface(const BakeRun& run);

// Means, errors and classes of all texels: merged sums, denoised over `surface` (null: not), with what is
// reported of their errors. `light`: of charts that --two-pass sized.
Lightmap resolve_map(const BakeRun& run, const Accumulator& sums, const SurfaceGraph* surface,
                     std::span<const ChartLight> light, Baked& baked);

// Fills, joins seams and dilates. Returns whether seams were joined.
bool complete_map(const BakeRun& run, Lightmap& map);

// Textures, masters, pictures and the report. `seams`: they were joined, so that textures keep both sides
// equal.
Status publish_map(const BakeRun& run, const Lightmap& map, bool seams);

}  // namespace kiln
