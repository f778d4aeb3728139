// Reads probe volumes from extras.kiln.probes.
#pragma once

#include <vector>

#include "common/probes/volume.h"
#include "coordinator/scene/import/nodes.h"

namespace kiln {

// {"min": [x, y, z], "max": [x, y, z], "spacing": m, "max_spacing": m, "visibility": true} of a node: a box
// in the node's space; spacings are metres in the world. A node that is turned gets the box in world axes
// around it, and a note. Errors name the node with any other value.
Expected<std::vector<ProbeBox>> read_probe_boxes(const ImportContext& context,
                                                 const std::vector<PlacedNode>& nodes, ImportNotes& notes);

}  // namespace kiln
