// What a BC6H block is to show, in the two spaces of the encoder: the one in which levels are interpolated
// and the one in which errors are measured.
#pragma once

#include <cstdint>

#include "coordinator/output/blocks/blocks.h"

namespace kiln::bc6h {

// Per channel and texel, so that 16 texels fill whole registers.
struct Target {
  alignas(32) float ends[3][16];    // spread over 16 bits, as end points are before interpolation
  alignas(32) float want[3][16];    // in the metric's space: bc6h_metric.h
  alignas(32) float fit[3][16];     // weight of squared differences of `ends`: what `weight` is there, nearly
  alignas(32) float texel_fit[16];  // the same, mean of the channels
  alignas(32) float weight[16];     // of squared distances of `want`; 0: nobody's texel
  alignas(32) float scale[16];      // the same without the texel's own weight
  float unit;                       // factor of linear values in the metric's space
  BlockMetric metric;
  bool is_signed;
};

// Weights are taken relative to the block's largest.
void make_target(const BlockTexels& texels, BlockMetric metric, bool is_signed, Target& target);

}  // namespace kiln::bc6h
