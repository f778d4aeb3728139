// The environment of the scene: the settings' constant or file, else EXT_lights_image_based.
#pragma once

#include <optional>
#include <vector>

#include "coordinator/scene/import/context.h"

namespace kiln {

// The record, if there is an environment; its image, if it has one, is appended to `textures`. Errors:
// a file of the settings that cannot be read or has a texel that is not a valid radiance. An unusable
// environment of the glTF is a warning.
Expected<std::optional<Record>> read_environment_light(const ImportContext& context,
                                                       std::vector<Texture>& textures, ImportNotes& notes);

}  // namespace kiln
