// BC7: 16 bytes for 4x4 texels of 8-bit RGB or RGBA.
#pragma once

#include "coordinator/output/blocks/blocks.h"

namespace kiln {

// Minimises squared differences of the decoded texels, weighted by texel; kPerceptual weights the colours by
// their share of the luminance. Efforts: fast is mode 6; normal adds two subsets (modes 1, 3, 7) for the
// partitions of lowest bound, and a separate channel (modes 4, 5); best adds three subsets (modes 0, 2), more
// partitions, and single steps of end points. A higher effort never has a larger error on any block.
void encode_bc7(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block);
// All modes; a block that starts with a zero byte (no mode) is transparent black.
void decode_bc7(const uint8_t* block, BlockTexels& texels);

}  // namespace kiln
