// extras.kiln.light of nodes: lights with an area.
#pragma once

#include <vector>

#include "coordinator/scene/import/lights.h"

namespace kiln {

// One record for each node that has one. The light lies in the node's xy plane around its origin and shines
// along -z; the node's scale is in the size, metres. Errors, which name the node: what is no light
// (docs/scenes.md), a transform that is singular, shears a rectangle, or makes an ellipse of a disc.
Expected<std::vector<PlacedLight>> read_area_lights(const ImportContext& context,
                                                    const std::vector<PlacedNode>& nodes);

}  // namespace kiln
