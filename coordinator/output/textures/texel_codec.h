// Encodes and decodes one image: a common interface for block formats, ASTC and plain formats.
#pragma once

#include "coordinator/output/blocks/blocks.h"
#include "coordinator/output/container/texture_format.h"
#include "coordinator/output/textures/pixel_codes.h"

namespace kiln {

// Texels of `image` are in the format's range: [0, 1] for unorm formats, [-1, 1] for snorm ones. With
// `unpack` (of kRgba8Unorm) values are packed first. Errors (kInvalidInput): a non-finite texel with weight,
// by its position in the image.
Expected<Bytes> encode_texels(TextureFormat format, Unpack unpack, const BlockImage& image,
                              const BlockChoice& choice);

// 4 floats a texel as returned by a lookup, before unpacking.
Expected<std::vector<float>> decode_texels(TextureFormat format, std::span<const std::byte> bytes,
                                           uint32_t width, uint32_t height);

// The block format of blocks.h; null: another one.
const BlockFormat* block_format(TextureFormat format);

// Smallest and largest value that the format can store (with its packing).
struct ValueRange {
  float lowest, highest;
};
ValueRange value_range(TextureFormat format, Unpack unpack);

}  // namespace kiln
