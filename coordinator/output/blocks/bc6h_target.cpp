#include "coordinator/output/blocks/bc6h_target.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/wide.h"
#include "coordinator/output/blocks/bc6h_metric.h"

namespace kiln::bc6h {
namespace {

// Luminances below this share of the block's largest are weighted as that share.
constexpr float kDarkest = 1e-3f;

// Value per step at a value: 2^-10 of its power of two.
KILN_INLINE float slope_at(float value) {
  const uint32_t power = std::bit_cast<uint32_t>(std::max(std::fabs(value), 0x1p-14f)) & 0x7F800000;
  return std::bit_cast<float>(power) * 0x1p-10f;
}

// End point values that decode to `step`: half_step() rounds down, hence the extra half step.
KILN_WIDE void find_ends(Target& target, const float (&steps)[3][16], bool is_signed) {
  const float factor = is_signed ? 32.0f / 31 : 64.0f / 31;
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < 16; ++i)
      target.ends[c][i] = factor * (steps[c][i] + std::min(std::max(steps[c][i], -0.5f), 0.5f));
}

void make_weights(const BlockTexels& texels, Target& target) {
  float largest = 0;
  for (const float w : texels.weight) largest = std::max(largest, w);
  for (int i = 0; i < 16; ++i) {
    const float w = texels.weight[i] > 0 ? std::min(texels.weight[i] / largest, 1.0f) : 0.0f;
    target.weight[i] = w;
    target.scale[i] = w > 0 ? 1.0f : 0.0f;
  }
}

void weigh_by_luminance(Target& target, const float (&values)[3][16]) {
  float size[16], largest = 0;
  for (int i = 0; i < 16; ++i) {
    size[i] = luminance(std::fabs(values[0][i]), std::fabs(values[1][i]), std::fabs(values[2][i]));
    if (target.weight[i] > 0) largest = std::max(largest, size[i]);
  }
  for (int i = 0; i < 16; ++i) {
    const float floor = largest > 0 ? std::max(size[i], kDarkest * largest) / largest : 1.0f;
    target.scale[i] /= floor * floor;
    target.weight[i] *= target.scale[i];
  }
}

}  // namespace

void make_target(const BlockTexels& texels, BlockMetric metric, bool is_signed, Target& target) {
  target.metric = metric;
  target.is_signed = is_signed;
  make_weights(texels, target);
  alignas(32) float steps[3][16], values[3][16];
  float largest = 0;
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < 16; ++i) {
      values[c][i] = texels.rgba[i][c];
      if (target.weight[i] > 0) largest = std::max(largest, std::fabs(values[c][i]));
      steps[c][i] = step_of(values[c][i]);
    }
  find_ends(target, steps, is_signed);
  target.unit = largest > 0 ? 1 / std::max(largest, 0x1p-24f) : 1.0f;
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < 16; ++i)
      target.want[c][i] = metric == BlockMetric::kLog ? steps[c][i] : values[c][i] * target.unit;
  if (metric == BlockMetric::kPerceptual) {
    weigh_by_luminance(target, values);
    for (int i = 0; i < 16; ++i) to_opponents(target.want[0][i], target.want[1][i], target.want[2][i]);
  }
  for (int i = 0; i < 16; ++i) {
    target.texel_fit[i] = 0;
    for (int c = 0; c < 3; ++c) {
      float slope = metric == BlockMetric::kLog ? 1.0f : slope_at(values[c][i]) * target.unit;
      if (metric == BlockMetric::kPerceptual) slope *= kLuminance[c] + kChroma * kChroma;
      target.fit[c][i] = target.weight[i] * slope * slope;
      target.texel_fit[i] += target.fit[c][i] / 3;
    }
  }
}

}  // namespace kiln::bc6h
