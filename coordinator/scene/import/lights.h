// Converts KHR_lights_punctual and the suns of the settings to light records.
#pragma once

#include <vector>

#include "coordinator/scene/import/nodes.h"

namespace kiln {

struct PlacedLight {
  uint32_t node = 0;
  Record record;
};

// Returns one light for each node that has one. Errors: an index that does not exist, a negative intensity,
// an unknown extras.kiln.bake.
Expected<std::vector<PlacedLight>> read_lights(const ImportContext& context,
                                               const std::vector<PlacedNode>& nodes, ImportNotes& notes);

// Counts a light of the file towards the import's memory: one profile may be named by a million lamps.
Status take_light(const ImportContext& context, const Record& light);

// The suns of the settings: -z of to_world points from the light to the scene.
std::vector<Record> sun_lights(const BakeSettings& settings);

// extras.kiln.bake: "full", "indirect" or "none"; "" if absent. Errors for other words.
Expected<std::string> bake_word(const ImportContext& context, const std::string& who,
                                const GltfValue& extras);

}  // namespace kiln
