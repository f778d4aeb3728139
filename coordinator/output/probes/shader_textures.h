// Probes as the textures that docs/shaders/kiln_probes.glsl reads.
#pragma once

#include "common/probes/field.h"
#include "coordinator/output/container/container.h"

namespace kiln {

// Probe i has column i % 64 and row i / 64 of each, in texels of that texture's tile.
struct ProbeTextures {
  TextureImages light;  // RGBA32F, 10 x 1: position and state, then L00 to L22 in RGB
  TextureImages
      irradiance;  // RGB9E5, 10 x 10: octahedral E with a border of one texel; empty without visibility
  TextureImages distance;  // RG16F, 18 x 18: mean distance and mean square, the same; at most 65504 each
};
ProbeTextures probe_textures(const ProbeField& field);

constexpr uint32_t kTextureSide = 16384;  // the largest of a 2-D texture that graphics processors promise
// The most probes whose textures have sides of kTextureSide at most.
uint64_t most_textured_probes(bool visibility);

}  // namespace kiln
