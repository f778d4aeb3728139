// Materials to records, as scene.h documents them.
#pragma once

#include <vector>

#include "coordinator/scene/import/context.h"
#include "coordinator/scene/import/textures.h"

namespace kiln {

// The record of a glTF material; -1 is glTF's default material. Its texture uses name slots of `textures`,
// to be resolved once they are decoded.
Record read_material(const ImportContext& context, int material, TextureSet& textures, ImportNotes& notes);

// Replaces slots by indices and drops the uses of textures that could not be decoded.
void resolve_textures(Record& material, const TextureSet& textures);

bool uses_uv_set(const Record& material, uint32_t set);
bool emits(const Record& material);

}  // namespace kiln
