// Lays out the bricks of a probe volume.
#pragma once

#include <span>

#include "common/base/status.h"
#include "common/probes/volume.h"
#include "common/scene/scene.h"

namespace kiln {

struct SolidTriangle {
  DVec3 corner[3];
};
std::vector<SolidTriangle> world_triangles(const Scene& scene);  // of instances that rays hit

// A volume, and the points of its probes in Morton order: in finest spacings from its corner. Indices of
// probes in the bricks count from `first_probe`.
struct PlacedVolume {
  ProbeVolume volume;
  std::vector<UVec3> points;
  // By point, of the bricks that use it (not of those that are refined): the smallest and the largest level.
  std::vector<uint8_t> finest, coarsest;
};

// Fills the box: bricks of the largest spacing, each halved as long as its box, grown by one of its own
// spacings, holds geometry, down to the smallest spacing. The volume begins at the box's low corner and ends
// at its high corner or up to one brick behind it; `centred`: what it stands out is the same on both sides.
// Fails (kInvalidInput) with more than `most` probes.
Expected<PlacedVolume> place_bricks(const ProbeBox& box, std::span<const SolidTriangle> triangles,
                                    uint32_t first_probe, uint64_t most, bool centred = false);

}  // namespace kiln
