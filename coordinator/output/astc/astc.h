// ASTC images in and out. The only user of libastcenc.
#pragma once

#include "coordinator/output/blocks/blocks.h"
#include "coordinator/output/container/texture_format.h"

namespace kiln {

// `format`: an ASTC format. UNORM: values in [0, 1]; SFLOAT: RGB in [0, 65504], alpha in [0, 1]; others are
// clamped. Efforts are the library's presets fast, medium and thorough; the metric is the library's own:
// squared differences, for SFLOAT on a nearly logarithmic scale. Without `choice.alpha` the fourth channel
// decodes as 1. The library has no texel weights: all above 0 count alike. With `fill`, texels of weight 0
// first get the weighted mean of the others in their block, and blocks without weight become 0 (fill_block in
// blocks.h). The same bytes for any number of threads, and on any x86-64: Debian's library is built for SSE2
// alone. Errors (kInvalidInput): a non-finite texel with weight, by its position; (kNoSpace): out of memory.
Expected<Bytes> encode_astc(TextureFormat format, const BlockImage& image, const BlockChoice& choice,
                            bool fill = true, unsigned threads = 0);

// 4 floats a texel. Reserved blocks decode to magenta in UNORM and NaN in SFLOAT. Errors (kInvalidInput): too
// few bytes.
Expected<std::vector<float>> decode_astc(TextureFormat format, std::span<const std::byte> blocks,
                                         uint32_t width, uint32_t height, unsigned threads = 0);

}  // namespace kiln
