// Converts extras.kiln.light of nodes to records of area lights.
#pragma once

#include <vector>

#include "coordinator/scene/import/lights.h"

namespace kiln {

// Returns one record for each node with an area light. The light lies in the node's xy plane, centred on its
// origin, and shines along -z; its size in metres includes the node's scale. Errors name the node: a value
// that does not describe a light (docs/scenes.md); a transform that is singular, shears a rectangle, or turns
// a disc into an ellipse.
Expected<std::vector<PlacedLight>> read_area_lights(const ImportContext& context,
                                                    const std::vector<PlacedNode>& nodes);

}  // namespace kiln
