// Textures of responses: ambient occlusion, sky visibility, bent normals.
#pragma once

#include "coordinator/output/textures/texture_files.h"
#include "coordinator/output/textures/textures.h"

namespace kiln {

// Adds to `result` one texture per response and encoding, in the encoding's scalar and vector formats: [0, 1]
// is stored directly, signed values as (1 + v) / 2 where the format is unsigned. Errors in their figures are
// absolute, at level 0 and texel centres. Encodings to float files of their own (exr, hdr) add nothing to the
// masters and are skipped.
Status make_response_textures(const EncodeTextures& request, TextureFolder& folder, TextureResult& result);

// Adds written files to the result, each name once. Returns their bytes.
uint64_t add_written(WrittenFiles written, const TextureFolder& folder, TextureResult& result);

}  // namespace kiln
