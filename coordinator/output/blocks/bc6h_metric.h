// The spaces in which BlockMetric measures squared distances: steps of half floats (a logarithm), values, or
// luminance and two colour differences. Inlined into functions for each instruction set.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/wide.h"
#include "coordinator/output/blocks/blocks.h"

namespace kiln::bc6h {

// Rec. 709. A squared colour difference counts a quarter of a squared luminance difference.
constexpr float kLuminance[3] = {0.2126f, 0.7152f, 0.0722f};
constexpr float kChroma = 0.5f;

// The bits of a half float as a real number, also between halfs: a logarithm of base 2^(1/1024), within 6 %,
// down to 2^-14; linear below.
KILN_INLINE float step_of(float value) {
  const float size = std::fabs(value);
  const auto bits = static_cast<int32_t>(std::bit_cast<uint32_t>(size));
  const float normal = static_cast<float>(bits - (112 << 23)) * 0x1p-13f;
  const float step = size < 0x1p-14f ? size * 0x1p24f : normal;
  return value < 0 ? -step : step;
}

// The inverse; `step` is an integer.
KILN_INLINE float value_of(float step) {
  const auto size = static_cast<int32_t>(std::fabs(step));
  const float value = std::bit_cast<float>(size << 13) * 0x1p112f;
  return step < 0 ? -value : value;
}

KILN_INLINE float luminance(float r, float g, float b) {
  return kLuminance[0] * r + kLuminance[1] * g + kLuminance[2] * b;
}

KILN_INLINE void to_opponents(float& r, float& g, float& b) {
  const float y = luminance(r, g, b);
  const float red = kChroma * (r - y), blue = kChroma * (b - y);
  r = y;
  g = red;
  b = blue;
}

// Levels, as signed steps. `unit`: factor of values.
template <int kCount>
KILN_INLINE void to_metric(BlockMetric metric, float unit, float (&levels)[3][kCount]) {
  if (metric == BlockMetric::kLog) return;
  for (auto& channel : levels)
    for (int l = 0; l < kCount; ++l) channel[l] = value_of(channel[l]) * unit;
  if (metric == BlockMetric::kPerceptual)
    for (int l = 0; l < kCount; ++l) to_opponents(levels[0][l], levels[1][l], levels[2][l]);
}

}  // namespace kiln::bc6h
