// Distinguishes truly dark texels beside lit ones from texels that found no light by chance.
#pragma once

#include "coordinator/bake/lightmap/texel_statistics.h"
#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

// Returns `links` without those between a truly dark texel and a lit one: where a board lies on a floor, one
// texel may have a thousandth of its neighbour's light, and no filter should mix the two. A texel is a
// candidate if each replicate found less than a fiftieth of the surrounding light. The texels around it tell
// how often that happens by chance: those lit in one replicate and dark in the other give the probability
// that a replicate of a lit texel finds nothing, and its square the probability for both, since replicates
// are independent. A candidate counts as dark where chance explains at most a tenth of the dark texels around
// it (a local false discovery rate: Efron, "Large-scale simultaneous hypothesis testing", 2004), within 2
// texels and within 6.4. Low counts are supplemented from the same piece of surface, or from all small
// pieces. Independent of the number of threads.
SurfaceLinks part_dark(const TexelStatistics& statistics, const SiteGeometry& sites,
                       const SurfaceLinks& links, unsigned threads);

}  // namespace kiln
