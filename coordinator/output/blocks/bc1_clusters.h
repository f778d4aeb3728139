// Cluster fit of BC1's four colours.
#pragma once

#include "coordinator/output/blocks/lanes.h"

namespace kiln {

// Finds the best division of the texels, ordered along the principal axis, into four runs at 0, 1, 2 and 3
// thirds of the way: for each division least squares gives the end points, and prefix sums give the error
// without visiting a texel (Brown 2006, "DXT Compression Techniques"). `ends` holds the axis on entry and the
// result on return.
void cluster_ends(const BlockLanes& lanes, float (*ends)[4]);

}  // namespace kiln
