// Textures of responses: ambient occlusion, sky visibility, bent normals.
#pragma once

#include "coordinator/output/textures/textures.h"

namespace kiln {

// Adds to `result` one texture a response and encoding, in the encoding's formats for one value and for a
// vector: [0, 1] as it is, signed values as (1 + v) / 2 where the format has no sign. Errors of their figures
// are absolute, of level 0 at the texels; encodings that hold floats in files of their own (exr, hdr) add
// nothing to the masters.
Status make_response_textures(const EncodeTextures& request, TextureResult& result);

}  // namespace kiln
