// The lightmap denoiser: filters each texel with its neighbours on the surface, as widely as the two
// replicates show that this lowers the error. docs/denoising.md has the method, sources and figures.
#pragma once

#include <memory>

#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/bake/lightmap/texel_statistics.h"
#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

struct Denoised {
  // [site][plane], from both replicates; unknown sites have the mean of both.
  ZeroedVector<float> mean;
  std::vector<float> luminance;  // [site] of E, filtered
  // [site] error of the luminance of E: filtered, the root of the estimated mean squared error, bias
  // included; measured, the error of the mean of both replicates, from their differences around the site. 0
  // at unknown sites; infinite where the measurement is not finite.
  std::vector<float> standard_error, raw_error;
  std::vector<float> strength;  // [site] 0: unfiltered; approaches 1 as more texels contribute
  std::vector<uint8_t> filled;  // [site] 1: has no samples and is filled from its neighbours on the surface
};

// The filters that were chosen for the statistics of a surface, to filter more planes of the same statistics.
// Takes 140 bytes a site.
struct ChosenFilters;
using KeptFilters = std::shared_ptr<const ChosenFilters>;  // null: none yet

// All planes get the same weights. Sites without samples get the mean of the filtered sites around them, with
// the larger of their errors and their spread as error. `bounds` (indices of planes; lights of them and E,
// planes 0 to 2, are never negative) limits directions to the length of their light. The same bits for any
// number of threads. `filters`: used if they were chosen for these statistics; else they are replaced by
// those chosen now. Takes about 10 microseconds a site on one core with 15 planes, 190 bytes a site besides
// the result, and 50 to 300 for windows that are kept (rooms at 8 texels a metre 50 to 170).
Denoised denoise(const TexelStatistics& statistics, std::span<const DirectionBound> bounds,
                 const SiteGeometry& sites, const SurfaceLinks& links, unsigned threads,
                 KeptFilters* filters = nullptr);

// The same without `mean`, for the errors only. Slightly cheaper per site.
Denoised denoise_luminance(const TexelStatistics& statistics, const SiteGeometry& sites,
                           const SurfaceLinks& links, unsigned threads, KeptFilters* filters = nullptr);

}  // namespace kiln
