// Converts materials to records, as documented in scene.h.
#pragma once

#include <vector>

#include "coordinator/scene/import/context.h"
#include "coordinator/scene/import/textures.h"

namespace kiln {

// The record of a glTF material; -1 is glTF's default material. Its texture references are slots of
// `textures`, to be resolved after decoding.
Record read_material(const ImportContext& context, int material, TextureSet& textures, ImportNotes& notes);

// Replaces slots by indices and drops references to textures that could not be decoded.
void resolve_textures(Record& material, const TextureSet& textures);

bool uses_uv_set(const Record& material, uint32_t set);
bool emits(const Record& material);

}  // namespace kiln
