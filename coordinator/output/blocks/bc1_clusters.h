// Cluster fit of BC1's four colours.
#pragma once

#include "coordinator/output/blocks/lanes.h"

namespace kiln {

// Ends of the best division of the texels, in their order along the principal axis, into four runs that lie
// 0, 1, 2 and 3 thirds of the way: for each division the ends are the solution of least squares, and its
// error is known without visiting a texel (Brown 2006, "DXT Compression Techniques"). `ends` gives the axis
// and takes the result.
void cluster_ends(const BlockLanes& lanes, float (*ends)[4]);

}  // namespace kiln
