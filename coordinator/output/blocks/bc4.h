// BC4: 8 bytes for 4x4 texels of one channel, without and with sign.
#pragma once

#include "coordinator/output/blocks/blocks.h"

namespace kiln {

// Encodes red and ignores the other channels. All metrics are the plain sum of squares, weighted by texel.
// Efforts: bc4_channel.h.
void encode_bc4(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block);
void encode_bc4_snorm(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block);
// Green and blue decode as 0, alpha as 1.
void decode_bc4(const uint8_t* block, BlockTexels& texels);
void decode_bc4_snorm(const uint8_t* block, BlockTexels& texels);

}  // namespace kiln
