// Converts EXT_lights_ies to light records.
#pragma once

#include <vector>

#include "coordinator/scene/import/lights.h"

namespace kiln {

// Returns one record for each node with a profile; profiles become textures that the records share. Errors: a
// profile that does not exist or cannot be read, an invalid multiplier or colour.
Expected<std::vector<PlacedLight>> read_ies_lights(const ImportContext& context,
                                                   const std::vector<PlacedNode>& nodes,
                                                   std::vector<Texture>& textures, ImportNotes& notes);

}  // namespace kiln
