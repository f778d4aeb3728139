// The surface's direction at every texel, for errors of light that depends on it.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln {

// Unit shading normals in the world at the first surface point of each texel; texels of a chart without one
// take the mean of their 3x3 neighbours, ring by ring. 0: nobody's.
std::vector<Vec3> texel_normals(const Scene& scene, const Atlas& atlas);

constexpr int kErrorNormals = 16;
// Directions over the hemisphere around a unit normal, evenly in solid angle (a spherical Fibonacci set,
// Keinert et al. 2015): what normal maps may ask for.
void hemisphere_normals(const Vec3& normal, Vec3 out[kErrorNormals]);

}  // namespace kiln
