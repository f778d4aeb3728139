// Converts planes to the values of one texture's texels, and back.
#pragma once

#include <array>
#include <span>

#include "coordinator/output/blocks/blocks.h"
#include "coordinator/output/textures/encodings.h"
#include "coordinator/output/textures/levels.h"

namespace kiln {

// plane = (scale x unpacked texel + bias) [x the ratio's denominator]
struct TextureScale {
  double scale = 1, bias = 0;
};

// Chosen from the texels with weight 1 of level 0.
//   values   a power of two, 1 if the largest is representable and not below 2^-6: what is small would lose
//   bits of a
//            half. Of packed 8-bit formats: at most 1/4 of the packing's largest value is not used.
//   ratios   [-1, 1], or the range that occurs
// `unit_factor` multiplies in addition: 1, or pi where E/pi is stored.
TextureScale choose_scale(const TextureLayout& layout, const MapLevel& level, bool fit, double unit_factor);

// Weight of a squared difference of a texel's values: the reported errors (texture_error.h) are relative to
// the light there plus a hundredth of the map's mean, whatever the plane.
struct TextureWeights {
  std::vector<float> encode;  // for the encoder, with `metric`
  std::vector<float> norm;    // of squared differences of plain values
  BlockMetric metric = BlockMetric::kLinear;
};
TextureWeights texture_weights(const TextureLayout& layout, const MapLevel& level, const TextureScale& scale,
                               BlockMetric metric);

// 4 values a texel (alpha 1), pages stacked. A ratio to 0 is 0. `clamped`: values of texels with weight 1
// outside the texture's range by more than 1e-6 of it, or negative where it stores no sign.
std::vector<float> texture_values(const TextureLayout& layout, const MapLevel& level,
                                  const TextureScale& scale, uint64_t* clamped = nullptr);

// Texels of a texture as a reader decodes them: level 0, pages stacked, before unpacking.
struct DecodedTexture {
  const TextureLayout* layout = nullptr;
  TextureScale scale;
  std::span<const float> texels;  // 4 a texel
};

// Planes of the layouts at a lookup: the sum of weight x texel, unpacked, scaled, multiplied. RGBE is
// unpacked before filtering, as it must be; the others after, as the hardware does. One value for each
// (layout, channel).
void lookup_planes(std::span<const DecodedTexture> textures, std::span<const size_t> texel,
                   std::span<const float> weight, float* planes);

}  // namespace kiln
