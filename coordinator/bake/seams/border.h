// The borders of all charts of all objects, in the world and in the atlas at once.
#pragma once

#include <cstdint>
#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

// A side of a face across which its chart does not go on.
struct BorderEdge {
  DVec3 p[2];            // ends in the world, metres
  DVec2 texel[2];        // the same in texels of `page`
  Vec3 normal[2];        // shading normals there: unit, world; 0 where there is none
  Vec3 inward{0.0f};     // unit, across the edge in the face's plane, into the face
  float texel_size = 0;  // metres a texel of this face measures
  uint32_t page = 0;
  uint32_t placement = 0;  // the chart: index into Atlas::placements
};

// In order of instance, face and side. A side that two faces of a chart share, with equal positions and
// coordinates at both ends, is no border; sides without length in the world and faces without area in the
// atlas are left out. The same for any number of threads.
std::vector<BorderEdge> border_edges(const Scene& scene, const Atlas& atlas);

}  // namespace kiln
