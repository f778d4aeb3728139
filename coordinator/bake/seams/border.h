// Chart borders of all objects, in world space and in the atlas.
#pragma once

#include <cstdint>
#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

// A side of a face where its chart ends.
struct BorderEdge {
  DVec3 p[2];            // ends in the world, metres
  DVec2 texel[2];        // the same in texels of `page`
  Vec3 normal[2];        // shading normals there: unit, world; 0 where there is none
  Vec3 inward{0.0f};     // unit, across the edge in the face's plane, into the face
  float texel_size = 0;  // metres per texel of this face
  uint32_t page = 0;
  uint32_t placement = 0;  // the chart: index into Atlas::placements
};

// In order of instance, face and side. A side shared by two faces of a chart, with equal positions and
// coordinates at both ends, is not a border. Skips sides without length in the world and faces without area
// in the atlas. Independent of the number of threads.
std::vector<BorderEdge> border_edges(const Scene& scene, const Atlas& atlas);

}  // namespace kiln
