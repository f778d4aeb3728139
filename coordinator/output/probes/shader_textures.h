// Probes as the textures that docs/shaders/kiln_probes.glsl reads.
#pragma once

#include "common/probes/field.h"
#include "coordinator/output/container/container.h"

namespace kiln {

// Tiles of texels, one a probe, in rows: 64 of `light`, of the octahedral maps 64 too, or as many as fit
// where their texture would be higher than kTextureSide otherwise. Maps are empty without visibility.
struct ProbeTextures {
  TextureImages light;       // RGBA32F, 10 x 1: position and state, then L00 to L22 in RGB
  TextureImages irradiance;  // RGB9E5, 10 x 10: octahedral E with a border of one texel
  TextureImages distance;    // RG16F, 18 x 18: mean distance and mean square, the same; at most 65504 each
};
ProbeTextures probe_textures(const ProbeField& field);

constexpr uint32_t kTextureSide =
    16384;  // of a 2-D texture: Direct3D 11's limit, and that of KTX2 files here
// The most probes whose textures have sides of kTextureSide at most.
uint64_t most_textured_probes(bool visibility);
uint64_t texture_bytes_of_probe(bool visibility);  // uncompressed

}  // namespace kiln
