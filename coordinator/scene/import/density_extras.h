// Reads texel density from extras.kiln.
#pragma once

#include <vector>

#include "coordinator/scene/import/nodes.h"

namespace kiln {

// "density" of nodes, meshes and materials, and "importance" of the scene; cameras are not read here.
// - density: a number above 0. A node's value applies to everything below it. The values of a primitive's
//   node and the nodes above, of its mesh and of its material multiply. Values outside 1/64 to 64 are clamped
//   with a note.
// - importance: a list of up to 256 {"box": {"min": [x, y, z], "max": [x, y, z]}, "density": f}, in metres.
// Errors name the element with any other value.
Expected<DensityWishes> read_density(const ImportContext& context, const std::vector<PlacedNode>& nodes,
                                     const Scene& scene, ImportNotes& notes);

}  // namespace kiln
