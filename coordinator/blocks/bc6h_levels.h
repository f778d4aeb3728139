// The levels between two end points as a decoder makes them, and for each texel the one with the least error.
#pragma once

#include "coordinator/blocks/bc6h_block.h"
#include "coordinator/blocks/bc6h_target.h"

namespace kiln::bc6h {

// For 16 texels: the nearest level of one pair of end points and its squared distance in the metric's space.
struct Nearest {
  alignas(32) int32_t index[16];
  alignas(32) float distance[16];
};

// `a`, `b`: end points by channel, in the mode's bits.
void find_nearest(const Target& target, int mode, const int (&a)[3], const int (&b)[3], Nearest& nearest);

// The weighted sum and the largest of the distances, over the texels whose bits are set.
struct Cost {
  float error = 0, worst = 0;
};
Cost cost_of(const Target& target, const Nearest& nearest, uint32_t texels);

}  // namespace kiln::bc6h
