// The target texels of a BC6H block in the encoder's two spaces: the one for interpolating levels and the one
// for measuring errors.
#pragma once

#include <cstdint>

#include "coordinator/output/blocks/blocks.h"

namespace kiln::bc6h {

// By channel, then texel, so that 16 texels fill whole registers.
struct Target {
  alignas(32) float ends[3][16];  // expanded to 16 bits, as end points are before interpolation
  alignas(32) float want[3][16];  // in the metric's space: bc6h_metric.h
  alignas(
      32) float fit[3][16];  // weight of squared differences of `ends`: approximates `weight` in that space
  alignas(32) float texel_fit[16];  // the same, mean of the channels
  alignas(32) float weight[16];     // of squared distances of `want`; 0: unused texel
  alignas(32) float scale[16];      // the same without the texel's own weight
  float unit;                       // factor of linear values in the metric's space
  BlockMetric metric;
  bool is_signed;
};

// Weights are taken relative to the block's largest.
void make_target(const BlockTexels& texels, BlockMetric metric, bool is_signed, Target& target);

}  // namespace kiln::bc6h
