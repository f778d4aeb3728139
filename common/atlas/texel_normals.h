// The surface normal at every texel.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

// Unit shading normals in the world at the first surface point of each texel; other texels of a chart get the
// mean of their 3x3 neighbours, ring by ring. 0: unused.
std::vector<Vec3> texel_normals(const Scene& scene, const Atlas& atlas);

}  // namespace kiln
