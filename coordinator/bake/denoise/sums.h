// Light that filters took from a surface, given back to it.
#pragma once

#include "coordinator/bake/denoise/denoise.h"

namespace kiln {

// Scales filtered sites (all planes, luminance and its error) so that each piece of connected surface has the
// sum of luminance that was measured. A filter's weights depend on geometry, but its choice and the bounds of
// light do not: peaks are lowered, and negative light is cut off. The sum over a piece has the same noise
// before and after. Pieces of less than 64 sites stay as they are, and no site changes by more than a
// quarter.
void restore_sums(const TexelStatistics& statistics, const SurfaceLinks& links, Denoised& denoised);

}  // namespace kiln
