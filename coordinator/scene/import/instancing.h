// Where the meshes of the scene stand.
#pragma once

#include <vector>

#include "coordinator/scene/import/nodes.h"

namespace kiln {

// One standing copy of a glTF mesh.
struct MeshPlace {
  uint32_t node = 0, mesh = 0;
  Affine to_world;
  uint32_t group = 0;  // as handed to place_meshes
};

// One place for each node with a mesh, or one for each instance of EXT_mesh_gpu_instancing. Places whose
// transform is singular (a scale of 0 hides things) are left out with a warning.
Expected<std::vector<MeshPlace>> place_meshes(const ImportContext& context,
                                              const std::vector<PlacedNode>& nodes, uint32_t group,
                                              ImportNotes& notes);

}  // namespace kiln
