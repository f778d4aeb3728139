// The surface normal at every texel, to measure errors of directional light.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln {

// Unit shading normals in the world at the first surface point of each texel; other texels of a chart get the
// mean of their 3x3 neighbours, ring by ring. 0: unused.
std::vector<Vec3> texel_normals(const Scene& scene, const Atlas& atlas);

constexpr int kErrorNormals = 16;
// Directions over the hemisphere around a unit normal, evenly in solid angle (a spherical Fibonacci set,
// Keinert et al. 2015): the normals that normal maps may use.
void hemisphere_normals(const Vec3& normal, Vec3 out[kErrorNormals]);

}  // namespace kiln
