// What objects take part in, under extras.kiln: receive, cast and reflect.
#pragma once

#include <vector>

#include "coordinator/scene/import/nodes.h"

namespace kiln {

// Booleans of nodes, meshes and materials. The most specific that says something wins: the primitive's
// material, then its mesh, then its node, then the node's nearest ancestor; nobody says anything: true.
// `nodes`: parents first. What takes no part in something is noted. Other keys of extras.kiln there that
// nobody knows are warned of. Errors name the element whose value is no boolean.
Status read_parts(const ImportContext& context, const std::vector<PlacedNode>& nodes, Scene& scene,
                  ImportNotes& notes);

}  // namespace kiln
