#include "coordinator/blocks/bc6h_levels.h"

#include <algorithm>

#include "common/base/wide.h"

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
  for (int l = 0; l < 16; ++l) weights.of[l] = kWeights8[l % 8];
  return weights;
}();

// Interpolation in floats is exact: all terms are whole and below 2^24.
KILN_WIDE void make_levels(const float (&weights)[16], const int (&a)[3], const int (&b)[3], bool is_signed,
                           float (&levels)[3][16]) {
  const int shift = is_signed ? 5 : 6;
  for (int c = 0; c < 3; ++c) {
    const auto base = static_cast<float>(64 * a[c] + 32), step = static_cast<float>(b[c] - a[c]);
    for (int l = 0; l < 16; ++l) {
      const int at = static_cast<int>(base + step * weights[l]) >> 6;
      const int sign = at >> 31, size = (at ^ sign) - sign;
      levels[c][l] = static_cast<float>(((((size << 5) - size) >> shift) ^ sign) - sign);
    }
  }
}

template <int kCount>
KILN_INLINE void nearest_of(const Target& target, const float (&levels)[3][16], Nearest& out) {
  alignas(32) float best[16];
  alignas(32) int32_t index[16];
  for (int i = 0; i < 16; ++i) {
    best[i] = 3e38f;
    index[i] = 0;
  }
  for (int l = 0; l < kCount; ++l) {
    const float r = levels[0][l], g = levels[1][l], b = levels[2][l];
    for (int i = 0; i < 16; ++i) {
      const float dr = target.want[0][i] - r, dg = target.want[1][i] - g, db = target.want[2][i] - b;
      const float distance = dr * dr + dg * dg + db * db;
      index[i] = distance < best[i] ? l : index[i];
      best[i] = distance < best[i] ? distance : best[i];
    }
  }
  for (int i = 0; i < 16; ++i) {
    out.distance[i] = best[i];
    out.index[i] = index[i];
  }
}

KILN_WIDE void nearest_of_16(const Target& target, const float (&levels)[3][16], Nearest& out) {
  nearest_of<16>(target, levels, out);
}
KILN_WIDE void nearest_of_8(const Target& target, const float (&levels)[3][16], Nearest& out) {
  nearest_of<8>(target, levels, out);
}

}  // namespace

void find_nearest(const Target& target, int mode, const int (&a)[3], const int (&b)[3], Nearest& nearest) {
  const int bits = kModeTable[mode].bits;
  int wide_a[3], wide_b[3];
  for (int c = 0; c < 3; ++c) {
    wide_a[c] = spread(a[c], bits, target.is_signed);
    wide_b[c] = spread(b[c], bits, target.is_signed);
  }
  alignas(32) float levels[3][16];
  const bool two = two_regions(mode);
  make_levels(two ? kLevels8.of : kLevels16.of, wide_a, wide_b, target.is_signed, levels);
  to_metric(target, two ? 8 : 16, levels);
  if (two)
    nearest_of_8(target, levels, nearest);
  else
    nearest_of_16(target, levels, nearest);
}

Cost cost_of(const Target& target, const Nearest& nearest, uint32_t texels) {
  Cost cost{0, 0};
  for (int i = 0; i < 16; ++i) {
    if (!(texels >> i & 1)) continue;
    cost.error += target.weight[i] * nearest.distance[i];
    cost.worst = std::max(cost.worst, target.scale[i] * nearest.distance[i]);
  }
  return cost;
}

}  // namespace kiln::bc6h
