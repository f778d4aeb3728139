// The levels between two end points as a decoder computes them, and the level of least error for each texel.
#pragma once

#include "coordinator/output/blocks/bc6h_block.h"
#include "coordinator/output/blocks/bc6h_target.h"

namespace kiln::bc6h {

struct Cost {
  float error = 0;  // weighted sum of squared distances in the metric's space
  float worst = 0;  // the largest of them, without the texel's own weight
};

// A region's texels: 1, others 0. One region: all.
using Mask = float[16];
const Mask& mask_of(const Block& block, int region);

// Assigns the region's texels their nearest levels. Returns the cost.
Cost find_indices(const Target& target, int region, Block& block);

}  // namespace kiln::bc6h
