// BC1: 8 bytes for 4x4 texels of RGB, end points of 5, 6 and 5 bits.
#pragma once

#include "coordinator/output/blocks/blocks.h"

namespace kiln {

// Opaque blocks of four colours; ignores alpha. Minimises squared differences of the decoded texels, weighted
// by texel; kPerceptual weights the colours by their share of the luminance. Efforts: fast fits a line and
// refines it once by least squares; normal refines it further and tries every step of one channel of one end;
// best starts from the best division into clusters too, and tries all neighbours of both ends for as long as
// that helps. A higher effort never has a larger error on any block.
void encode_bc1(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block);
// Blocks of four colours, and of three and transparent black. The format leaves the rounding of interpolated
// colours to the decoder (GPUs differ by up to 3 of 255): here end points are rounded to bytes and colours to
// the nearest byte, halves up.
void decode_bc1(const uint8_t* block, BlockTexels& texels);

}  // namespace kiln
