// BC6H: 4x4 texels of three half floats in 16 bytes, without and with sign. Between two end points (or two
// pairs of them, over one of 32 partitions) lie 16 (or 8) levels, interpolated over the bits of half floats.
// Sources: Direct3D 11's programming guide, "BC6H Format"; docs/encoding.md.
#pragma once

#include "coordinator/output/blocks/blocks.h"

namespace kiln {

constexpr float kLargestHalf = 65504;

// See BlockFormat::encode and decode. Alpha is not stored and decodes as 1; reserved modes decode as 0.
void encode_bc6h_ufloat(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block);
void encode_bc6h_sfloat(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block);
void decode_bc6h_ufloat(const uint8_t* block, BlockTexels& texels);
void decode_bc6h_sfloat(const uint8_t* block, BlockTexels& texels);

}  // namespace kiln
