// The denoiser on texels joined two by two: wide where samples are few, quick where texels are many.
#pragma once

#include "coordinator/bake/denoise/denoise.h"

namespace kiln {

// Steps of joining that serve these samples best: 2 up to 8 samples of a replicate (of the median texel), 1
// up to 32, then 0 (docs/denoising.md, "Joined texels").
uint32_t denoise_levels(const TexelStatistics& statistics);

// Share of the sites that are on surfaces whose texels may be joined: on others denoise_joined takes as long
// as denoise() does, whatever the levels.
double share_of_large_pieces(const SurfaceLinks& links);

// Joins texels of large surfaces in `levels` steps of two by two (of one chart, where the surface goes on),
// filters what is left by denoise(), and goes back step by step: linear between the joined texels, plus as
// much of what texels differ from that as both replicates agree on. Sites without samples take what lies
// around them. About 5 microseconds a site at 2 levels with 15 planes on one core. 0 levels: denoise()
// itself. The same bits for any number of threads.
Denoised denoise_joined(const TexelStatistics& statistics, std::span<const DirectionBound> bounds,
                        const SiteGeometry& sites, const SurfaceLinks& links, uint32_t levels,
                        unsigned threads);

// The same without `mean`.
Denoised denoise_joined_luminance(const TexelStatistics& statistics, const SiteGeometry& sites,
                                  const SurfaceLinks& links, uint32_t levels, unsigned threads);

}  // namespace kiln
