// One channel of 4x4 texels in 8 bytes, used once by BC4 and twice by BC5: two 8-bit end points and a 3-bit
// index per texel, into eight values from end to end or into six plus the bottom and top of the range.
// Source: Khronos Data Format Specification 1.4, "RGTC Compressed Texture Image Formats"; Direct3D 11's
// programming guide, "BC4 Format".
#pragma once

#include "coordinator/output/blocks/blocks.h"

namespace kiln {

// Minimises the sum of squared differences, weighted by texel, of channel `channel` of the decoded block;
// values are in [0, 1], or in [-1, 1] with sign. Efforts: fast starts from the smallest and the largest value
// and refines them once by least squares, for both sets of values; normal refines further and then steps the
// ends while that helps; best finds the optimal ends. A higher effort never has a larger error on any block,
// and all are optimal where all texels are equal.
void encode_channel(const BlockTexels& texels, int channel, bool is_signed, BlockEffort effort,
                    uint8_t* block);

// Writes one channel of the texels, rounding the specification's fractions to the nearest floats. With sign,
// an end of -128 decodes as -1, like -127. The specification leaves open whether -127 then -128 selects eight
// values or six (EXT_texture_compression_rgtc); here it is eight, and encode_channel never writes -128.
void decode_channel(const uint8_t* block, bool is_signed, int channel, BlockTexels& texels);

}  // namespace kiln
