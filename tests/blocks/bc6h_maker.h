// Blocks to encode, and the errors of what comes back, in the words of docs and not of the encoder.
#pragma once

#include <random>

#include "coordinator/output/blocks/blocks.h"

namespace kiln::test {

float value_of_half(int bits);  // below 0x7C00; negative bits: of the negative value
double step_of(double value);   // bits of a half float as a real number; the inverse for whole ones
BlockTexels solid(float r, float g, float b);

// A plane of light in each channel's logarithm, with some noise on it; `range`: stops over the block.
BlockTexels smooth_block(std::mt19937& random, float range, float noise, bool with_signs = false);

BlockTexels round_trip(const BlockFormat& format, const BlockTexels& texels, const BlockChoice& choice);

// Sum over the texels of squared errors, as BlockMetric names them, by weight.
double error_of(const BlockTexels& wanted, const BlockTexels& got, BlockMetric metric);

}  // namespace kiln::test
