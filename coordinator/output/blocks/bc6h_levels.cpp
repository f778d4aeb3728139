#include "coordinator/output/blocks/bc6h_levels.h"

#include <algorithm>

#include "common/base/wide.h"
#include "coordinator/output/blocks/bc6h_metric.h"

namespace kiln::bc6h {
namespace {

struct LevelWeights {
  alignas(32) float of[16];
};
constexpr LevelWeights kLevels16 = [] {
  LevelWeights weights{};
  for (int l = 0; l < 16; ++l) weights.of[l] = kWeights16[l];
  return weights;
}();
constexpr LevelWeights kLevels8 = [] {
  LevelWeights weights{};
  for (int l = 0; l < 8; ++l) weights.of[l] = kWeights8[l];
  return weights;
}();

struct Masks {
  alignas(32) Mask of[1 + 2 * kPartitions];
};
constexpr Masks kMasks = [] {
  Masks masks{};
  for (int i = 0; i < 16; ++i) {
    masks.of[0][i] = 1;
    for (int p = 0; p < kPartitions; ++p) {
      const int second = kPartitionTable[p] >> i & 1;
      masks.of[1 + 2 * p + second][i] = 1;
    }
  }
  return masks;
}();

// Expanded end points.
struct Ends {
  float a[3], b[3];
};

// Interpolation in floats is exact: all terms are integers below 2^24.
template <int kCount, bool kSigned>
KILN_INLINE void make_levels(const Ends& ends, float (&levels)[3][kCount]) {
  const auto& weights = kCount == 16 ? kLevels16.of : kLevels8.of;
  for (int c = 0; c < 3; ++c) {
    const float base = 64 * ends.a[c] + 32, step = ends.b[c] - ends.a[c];
    for (int l = 0; l < kCount; ++l) {
      const int at = static_cast<int>(base + step * weights[l]) >> 6;
      if constexpr (kSigned) {
        const int sign = at >> 31, size = (at ^ sign) - sign;
        levels[c][l] = static_cast<float>(((((size << 5) - size) >> 5) ^ sign) - sign);
      } else {
        levels[c][l] = static_cast<float>(((at << 5) - at) >> 6);
      }
    }
  }
}

// In a fixed order that suits registers of any width.
KILN_INLINE float sum_of(float (&v)[16]) {
  for (int i = 0; i < 8; ++i) v[i] += v[i + 8];
  for (int i = 0; i < 4; ++i) v[i] += v[i + 4];
  return (v[0] + v[2]) + (v[1] + v[3]);
}
KILN_INLINE float largest_of(float (&v)[16]) {
  for (int i = 0; i < 8; ++i) v[i] = std::max(v[i], v[i + 8]);
  for (int i = 0; i < 4; ++i) v[i] = std::max(v[i], v[i + 4]);
  return std::max(std::max(v[0], v[2]), std::max(v[1], v[3]));
}

template <int kCount, bool kSigned>
KILN_INLINE Cost nearest(const Target& target, const Ends& ends, const Mask& mask, uint8_t (&index)[16]) {
  alignas(32) float levels[3][kCount];
  make_levels<kCount, kSigned>(ends, levels);
  to_metric<kCount>(target.metric, target.unit, levels);
  alignas(32) float best[16];
  alignas(32) int32_t at[16];
  for (int i = 0; i < 16; ++i) {
    best[i] = 3e38f;
    at[i] = 0;
  }
  for (int l = 0; l < kCount; ++l) {
    const float r = levels[0][l], g = levels[1][l], b = levels[2][l];
    for (int i = 0; i < 16; ++i) {
      const float dr = target.want[0][i] - r, dg = target.want[1][i] - g, db = target.want[2][i] - b;
      const float distance = dr * dr + dg * dg + db * db;
      at[i] = distance < best[i] ? l : at[i];
      best[i] = distance < best[i] ? distance : best[i];
    }
  }
  alignas(32) float error[16], size[16];
  for (int i = 0; i < 16; ++i) {
    const float distance = best[i] * mask[i];
    error[i] = target.weight[i] * distance;
    size[i] = target.scale[i] * distance;
  }
  for (int i = 0; i < 16; ++i) index[i] = mask[i] != 0 ? static_cast<uint8_t>(at[i]) : index[i];
  return {sum_of(error), largest_of(size)};
}

KILN_WIDE Cost nearest_16(const Target& target, const Ends& ends, const Mask& mask, uint8_t (&index)[16]) {
  return nearest<16, false>(target, ends, mask, index);
}
KILN_WIDE Cost nearest_8(const Target& target, const Ends& ends, const Mask& mask, uint8_t (&index)[16]) {
  return nearest<8, false>(target, ends, mask, index);
}
KILN_WIDE Cost nearest_16s(const Target& target, const Ends& ends, const Mask& mask, uint8_t (&index)[16]) {
  return nearest<16, true>(target, ends, mask, index);
}
KILN_WIDE Cost nearest_8s(const Target& target, const Ends& ends, const Mask& mask, uint8_t (&index)[16]) {
  return nearest<8, true>(target, ends, mask, index);
}

}  // namespace

const Mask& mask_of(const Block& block, int region) {
  return kMasks.of[two_regions(block.mode) ? 1 + 2 * block.partition + region : 0];
}

Cost find_indices(const Target& target, int region, Block& block) {
  const int bits = kModeTable[block.mode].bits;
  Ends ends;
  for (int c = 0; c < 3; ++c) {
    ends.a[c] = static_cast<float>(spread(block.ends[2 * region][c], bits, target.is_signed));
    ends.b[c] = static_cast<float>(spread(block.ends[2 * region + 1][c], bits, target.is_signed));
  }
  const Mask& mask = mask_of(block, region);
  if (two_regions(block.mode))
    return (target.is_signed ? nearest_8s : nearest_8)(target, ends, mask, block.index);
  return (target.is_signed ? nearest_16s : nearest_16)(target, ends, mask, block.index);
}

}  // namespace kiln::bc6h
