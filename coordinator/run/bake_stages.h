// The stages of a bake that bake_run.cpp lists, from the surface to the published files.
#pragma once

#include <optional>

#include "coordinator/run/baking.h"
#include "coordinator/run/probe_run.h"
#include "coordinator/run/two_pass.h"

namespace kiln {

// State shared by the stages of one bake.
struct BakeRun {
  const BakeRequest& request;
  const Stopwatch& watch;  // started with the bake
  const std::function<void(const BakeProgress&)>& progress;
  BakeReport& report;
  const Preflight& preflight;
  TimeBudget& budget;
  SeamFinder& seams;
  const BakedProbes* probes = nullptr;  // null: none
};

// The surface that the denoiser filters over, with links between texels that see the same things.
SurfaceGraph find_surface(const BakeRun& run);

// Luminance and error of every texel, filtered over the surface; the error is infinite where nothing is
// known. `levels`: of joined texels (coordinator/bake/denoise/coarse.h). `filters` receives those chosen.
TexelErrors filtered_errors(const TexelStatistics& statistics, const SurfaceGraph& surface, uint32_t levels,
                            KeptFilters& filters);

// By site: 1 where the mean over a texel is not what paths meet that arrive there; empty without caches.
// `surface`: as found before, or null.
std::vector<uint8_t> misleading_sites(const BakeRun& run, const SurfaceGraph* surface);

// Means, errors and classes of all texels: merged sums, denoised over `surface` (null: not
// denoised), with their reported errors. `light`: of charts that --two-pass collapsed.
Lightmap resolve_map(const BakeRun& run, const Accumulator& sums, const SurfaceGraph* surface,
                     std::span<const ChartLight> light, Baked& baked);

// Fills, joins seams and dilates. Returns whether seams were joined.
bool complete_map(const BakeRun& run, Lightmap& map);

// Publishes textures, masters, pictures and the report. `seams`: seams were joined, so textures
// must keep both sides equal.
Status publish_map(const BakeRun& run, const Lightmap& map, bool seams);

}  // namespace kiln
