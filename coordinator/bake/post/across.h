// Charts without a value, from the charts that go on from them in the world.
#pragma once

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/bake/seams/match.h"

namespace kiln {

// Texels at the seams (coordinator/bake/seams: the surface goes on there) of charts that have no texel set
// take the mean of what lookups on the other side give, in all planes but "samples", and the class kFilled.
// True if any did. Charts further than one seam from a value want another call.
bool fill_across_seams(Lightmap& map, SeamFinder& seams);

}  // namespace kiln
