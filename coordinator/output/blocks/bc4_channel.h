// One channel of 4x4 texels in 8 bytes: what BC4 has once and BC5 twice. Two end points of 8 bits and a 3-bit
// place for each texel, among eight values from end to end or among six and the bottom and top of the range.
// Source: Khronos Data Format Specification 1.4, "RGTC Compressed Texture Image Formats"; Direct3D 11's
// programming guide, "BC4 Format".
#pragma once

#include "coordinator/output/blocks/blocks.h"

namespace kiln {

// Makes small the sum of squares of differences, weighted by texel, of channel `channel` of the decoded
// block; without sign values are in [0, 1], with it in [-1, 1]. Efforts: fast takes the least and the largest
// value as ends and refines them once by least squares, with either set of values; normal refines them
// further and then moves the ends by a step for as long as that helps; best finds the best ends there are. An
// effort never errs more than the one before on any block, and all are as good as can be where all texels are
// equal.
void encode_channel(const BlockTexels& texels, int channel, bool is_signed, BlockEffort effort,
                    uint8_t* block);

// Writes one channel of the texels. The specification's values are fractions; these are the floats nearest to
// them. Of ends with sign -128 is -1, as -127 is. Whether -127 then -128 makes eight values or six is left
// open (EXT_texture_compression_rgtc); here it is eight, and encode_channel writes no -128.
void decode_channel(const uint8_t* block, bool is_signed, int channel, BlockTexels& texels);

}  // namespace kiln
