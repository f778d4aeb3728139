// Positions of the scene's meshes.
#pragma once

#include <vector>

#include "coordinator/scene/import/nodes.h"

namespace kiln {

// One placed copy of a glTF mesh.
struct MeshPlace {
  uint32_t node = 0, mesh = 0;
  Affine to_world;
  uint32_t group = 0;  // as passed to place_meshes
};

// One entry per node with a mesh, or per instance of EXT_mesh_gpu_instancing. Entries with a singular
// transform (a scale of 0 hides things) are dropped with a warning.
Expected<std::vector<MeshPlace>> place_meshes(const ImportContext& context,
                                              const std::vector<PlacedNode>& nodes, uint32_t group,
                                              ImportNotes& notes);

}  // namespace kiln
