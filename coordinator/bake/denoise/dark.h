// Texels that are dark beside lit ones, told from those that met no light by chance.
#pragma once

#include "coordinator/bake/lightmap/texel_statistics.h"
#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

// `links` without those between a texel that is truly dark and one that is not: where a board lies on a
// floor, one texel may have a thousandth of the next one's light, and no filter should mix the two. A texel
// may be dark where each replicate met less than a fiftieth of the light around it. How often chance does
// that is counted on the texels around: one that is lit in one replicate and dark in the other says how
// likely a replicate of a lit texel meets nothing, and the square of that is how likely both do, since
// replicates are independent. A texel is taken for dark where chance explains at most a tenth of the dark
// texels around it (a local false discovery rate: Efron, "Large-scale simultaneous hypothesis testing",
// 2004), within 2 texels and within 6.4. Few counts are filled up with those of the piece of surface, or of
// all small pieces. The same for any number of threads.
SurfaceLinks part_dark(const TexelStatistics& statistics, const SiteGeometry& sites,
                       const SurfaceLinks& links, unsigned threads);

}  // namespace kiln
