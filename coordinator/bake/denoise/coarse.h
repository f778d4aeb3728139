// The denoiser on merged 2 x 2 texels: wide filters at low sample counts, fast on large maps.
#pragma once

#include "coordinator/bake/denoise/denoise.h"

namespace kiln {

// The best number of merge levels for these samples: 2 up to 8 samples per replicate (of the median texel), 1
// up to 24, then 0 (docs/denoising.md, "Joined texels").
uint32_t denoise_levels(const TexelStatistics& statistics);

// Share of sites on surfaces whose texels may be merged: on others denoise_joined takes as long as denoise(),
// whatever the levels.
double share_of_large_pieces(const SurfaceLinks& links);

// Merges texels of large surfaces in `levels` steps of 2 x 2 (within a chart, where the surface is
// continuous), filters the result with denoise(), and upsamples step by step: linear interpolation of merged
// texels, plus the part of the residual that both replicates agree on. Sites without samples are filled from
// their surroundings; the sum of a surface is kept (sums.h). About 5 microseconds a site at 2 levels with 15
// planes on one core. 0 levels: calls denoise(). `filters`: as there. The same bits for any number of
// threads.
Denoised denoise_joined(const TexelStatistics& statistics, std::span<const DirectionBound> bounds,
                        const SiteGeometry& sites, const SurfaceLinks& links, uint32_t levels,
                        unsigned threads, KeptFilters* filters = nullptr);

// The same without `mean`.
Denoised denoise_joined_luminance(const TexelStatistics& statistics, const SiteGeometry& sites,
                                  const SurfaceLinks& links, uint32_t levels, unsigned threads,
                                  KeptFilters* filters = nullptr);

}  // namespace kiln
