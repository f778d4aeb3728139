// Reads the meshes of levels that are not baked and of objects with a proxy, without adding them to the
// scene.
#pragma once

#include "coordinator/scene/import/instancing.h"
#include "coordinator/scene/import/levels.h"

namespace kiln {

// Errors: as reading the scene's own meshes; nothing to bake for a set that draws something.
Expected<Display> read_display(const ImportContext& context, const Levels& levels,
                               const std::vector<uint32_t>& group_of_instance, ImportNotes& notes);

// An instance without its material.
Instance instance_of(const ImportContext& context, const MeshPlace& place, uint32_t primitive, uint32_t mesh);

// Counts an object of a mesh that stands at a place towards the import's memory.
Status take_instance(const ImportContext& context, const MeshPlace& place, const Mesh& mesh);

// A mesh's corners of least and greatest coordinates; of an empty mesh, the origin.
struct MeshBounds {
  DVec3 low{0.0}, high{0.0};
  explicit MeshBounds(const Mesh& mesh);
};

// Refuses instances that float arithmetic cannot hold: a corner of the bounds must stay well below the
// square root of the largest float, because distances are squared.
Status check_extent(const ImportContext& context, const MeshPlace& place, const Mesh& mesh,
                    const MeshBounds& bounds);

}  // namespace kiln
