// BC5: 16 bytes for 4x4 texels of two channels, without and with sign: a block of BC4 for each.
#pragma once

#include "coordinator/output/blocks/blocks.h"

namespace kiln {

// Red and green, each by itself; blue and alpha are not looked at. All metrics are the plain sum of squares,
// weighted by texel. Efforts: bc4_channel.h.
void encode_bc5(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block);
void encode_bc5_snorm(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block);
// Blue decodes as 0, alpha as 1.
void decode_bc5(const uint8_t* block, BlockTexels& texels);
void decode_bc5_snorm(const uint8_t* block, BlockTexels& texels);

}  // namespace kiln
