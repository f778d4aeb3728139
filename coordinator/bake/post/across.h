// Fills charts without any value from charts that continue them in the world.
#pragma once

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/bake/seams/match.h"

namespace kiln {

// At seams (coordinator/bake/seams: the surface is continuous there), texels of charts without any set texel
// get the mean of lookups on the other side, in all planes but "samples", and the class kFilled. Returns true
// if any did. Charts more than one seam from a value need another call.
bool fill_across_seams(Lightmap& map, SeamFinder& seams);

}  // namespace kiln
