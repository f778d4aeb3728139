// Roles of objects under extras.kiln: receive, cast and reflect.
#pragma once

#include <vector>

#include "coordinator/scene/import/nodes.h"

namespace kiln {

// Booleans of nodes, meshes and materials. The most specific value wins: the primitive's material, then its
// mesh, then its node, then the node's nearest ancestor; default true. `nodes`: parents first. Notes every
// object with a false value and warns about unknown keys of extras.kiln. Errors name the element whose value
// is not a boolean.
Status read_parts(const ImportContext& context, const std::vector<PlacedNode>& nodes, Scene& scene,
                  ImportNotes& notes);

}  // namespace kiln
