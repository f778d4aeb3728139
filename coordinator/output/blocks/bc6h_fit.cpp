#include "coordinator/output/blocks/bc6h_fit.h"

#include <algorithm>
#include <cmath>

#include "common/base/wide.h"
#include "coordinator/output/blocks/bc6h_modes.h"

namespace kiln::bc6h {
namespace {

constexpr int kPowerRounds = 4;

// First and second moments about `origin`: of x, y, z; xx, yy, zz, xy, xz, yz.
constexpr int kMoments = 10;  // the first is the weight

struct Masks {
  alignas(32) float of[16][kPartitions];
};
constexpr Masks kMasks = [] {
  Masks masks{};
  for (int i = 0; i < 16; ++i)
    for (int p = 0; p < kPartitions; ++p) masks.of[i][p] = static_cast<float>(kPartitionTable[p] >> i & 1);
  return masks;
}();

struct PartitionCosts {
  alignas(32) float of[kPartitions];
};

// The residual scatter after quantising to `levels` on the principal axis, with the scatter about the mean
// from the moments. The matrix norm approximates the largest eigenvalue, exactly if it is the only one.
KILN_INLINE float remainder_of(float w, float x, float y, float z, float xx, float yy, float zz, float xy,
                               float xz, float yz) {
  const float by = 1 / std::max(w, 1e-20f);
  const float cxx = xx - x * x * by, cyy = yy - y * y * by, czz = zz - z * z * by;
  const float cxy = xy - x * y * by, cxz = xz - x * z * by, cyz = yz - y * z * by;
  const float all = cxx + cyy + czz;
  const float norm = std::sqrt(cxx * cxx + cyy * cyy + czz * czz + 2 * (cxy * cxy + cxz * cxz + cyz * cyz));
  return std::max(all - norm, 0.0f) + norm * (1.0f / 49);
}

KILN_WIDE void partition_costs(const float (&moments)[16][kMoments], const float (&total)[kMoments],
                               PartitionCosts& costs) {
  alignas(32) float one[kMoments][kPartitions] = {};
  for (int i = 0; i < 16; ++i)
    for (int m = 0; m < kMoments; ++m)
      for (int p = 0; p < kPartitions; ++p) one[m][p] += kMasks.of[i][p] * moments[i][m];
  for (int p = 0; p < kPartitions; ++p)
    costs.of[p] =
        remainder_of(one[0][p], one[1][p], one[2][p], one[3][p], one[4][p], one[5][p], one[6][p], one[7][p],
                     one[8][p], one[9][p]) +
        remainder_of(total[0] - one[0][p], total[1] - one[1][p], total[2] - one[2][p], total[3] - one[3][p],
                     total[4] - one[4][p], total[5] - one[5][p], total[6] - one[6][p], total[7] - one[7][p],
                     total[8] - one[8][p], total[9] - one[9][p]);
}

struct Mean {
  float weight, at[3];
};

// Sums 16 numbers in a fixed order that suits registers of any width.
KILN_INLINE float sum_of(const float (&v)[16]) {
  float s[8];
  for (int i = 0; i < 8; ++i) s[i] = v[i] + v[i + 8];
  for (int i = 0; i < 4; ++i) s[i] += s[i + 4];
  return (s[0] + s[2]) + (s[1] + s[3]);
}

KILN_WIDE Mean mean_of(const Target& target, const Mask& mask) {
  alignas(32) float weight[16], terms[16];
  for (int i = 0; i < 16; ++i) weight[i] = mask[i] * target.texel_fit[i];
  Mean mean;
  mean.weight = sum_of(weight);
  const float by = mean.weight > 0 ? 1 / mean.weight : 0.0f;
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < 16; ++i) terms[i] = weight[i] * target.ends[c][i];
    mean.at[c] = sum_of(terms) * by;
  }
  return mean;
}

// About the mean: xx, yy, zz, xy, xz, yz.
KILN_WIDE void scatter_of(const Target& target, const Mask& mask, const Mean& mean, float (&scatter)[6]) {
  constexpr int kPairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  alignas(32) float off[3][16], weighted[3][16], terms[16];
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < 16; ++i) {
      off[c][i] = target.ends[c][i] - mean.at[c];
      weighted[c][i] = mask[i] * target.texel_fit[i] * off[c][i];
    }
  for (int k = 0; k < 6; ++k) {
    for (int i = 0; i < 16; ++i) terms[i] = weighted[kPairs[k][0]][i] * off[kPairs[k][1]][i];
    scatter[k] = sum_of(terms);
  }
}

// The smallest and the largest coordinate on the axis, relative to the mean.
KILN_WIDE void extent_of(const Target& target, const Mask& mask, const Mean& mean, const float (&axis)[3],
                         float& low, float& high) {
  alignas(32) float at[16];
  for (int i = 0; i < 16; ++i) {
    const float on = axis[0] * (target.ends[0][i] - mean.at[0]) + axis[1] * (target.ends[1][i] - mean.at[1]) +
                     axis[2] * (target.ends[2][i] - mean.at[2]);
    at[i] = mask[i] * target.weight[i] > 0 ? on : 0.0f;
  }
  low = high = 0;
  for (int i = 0; i < 16; ++i) {
    low = std::min(low, at[i]);
    high = std::max(high, at[i]);
  }
}

// By rounds of the power method from the longest column.
void principal_axis(const float (&c)[6], float (&axis)[3]) {  // xx, yy, zz, xy, xz, yz
  float v[3] = {c[0], c[3], c[4]};
  if (c[1] > c[0] && c[1] >= c[2]) v[0] = c[3], v[1] = c[1], v[2] = c[5];
  if (c[2] > c[0] && c[2] > c[1]) v[0] = c[4], v[1] = c[5], v[2] = c[2];
  for (int round = 0; round < kPowerRounds; ++round) {
    const float x = c[0] * v[0] + c[3] * v[1] + c[4] * v[2];
    const float y = c[3] * v[0] + c[1] * v[1] + c[5] * v[2];
    const float z = c[4] * v[0] + c[5] * v[1] + c[2] * v[2];
    const float size = std::max({std::fabs(x), std::fabs(y), std::fabs(z)});
    if (!(size > 0)) break;
    v[0] = x / size;
    v[1] = y / size;
    v[2] = z / size;
  }
  const float length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  for (int k = 0; k < 3; ++k) axis[k] = length > 0 ? v[k] / length : 0.0f;
}

}  // namespace

KILN_WIDE Line box_diagonal(const Target& target, const Mask& mask) {
  Line line;
  for (int c = 0; c < 3; ++c) {
    float low = 3e38f, high = -3e38f;
    for (int i = 0; i < 16; ++i) {
      const bool counts = mask[i] * target.weight[i] > 0;
      low = std::min(low, counts ? target.ends[c][i] : 3e38f);
      high = std::max(high, counts ? target.ends[c][i] : -3e38f);
    }
    line.a[c] = low <= high ? low : 0.0f;
    line.b[c] = low <= high ? high : 0.0f;
  }
  return line;
}

Line principal_line(const Target& target, const Mask& mask) {
  const Mean mean = mean_of(target, mask);
  float scatter[6], axis[3], low, high;
  scatter_of(target, mask, mean, scatter);
  principal_axis(scatter, axis);
  extent_of(target, mask, mean, axis, low, high);
  Line line;
  for (int c = 0; c < 3; ++c) {
    line.a[c] = mean.at[c] + low * axis[c];
    line.b[c] = mean.at[c] + high * axis[c];
  }
  return line;
}

KILN_WIDE void least_squares(const Target& target, const Mask& mask, const uint8_t (&index)[16], int count,
                             Line& line) {
  alignas(32) float s[16], t[16], ws[16], wt[16], terms[16];
  const uint8_t* const weights = count == 16 ? kWeights16.data() : kWeights8.data();
  for (int i = 0; i < 16; ++i) t[i] = weights[index[i]];
  for (int i = 0; i < 16; ++i) {
    t[i] *= 1.0f / 64;
    s[i] = 1 - t[i];
  }
  Line made = line;
  float aa = 0, ab = 0, bb = 0;
  for (int c = 0; c < 3; ++c) {
    if (c == 0 || target.metric != BlockMetric::kLog) {  // in that space all channels have weight one
      for (int i = 0; i < 16; ++i) {
        const float w = mask[i] * target.fit[c][i];
        ws[i] = w * s[i];
        wt[i] = w * t[i];
      }
      for (int i = 0; i < 16; ++i) terms[i] = ws[i] * s[i];
      aa = sum_of(terms);
      for (int i = 0; i < 16; ++i) terms[i] = ws[i] * t[i];
      ab = sum_of(terms);
      for (int i = 0; i < 16; ++i) terms[i] = wt[i] * t[i];
      bb = sum_of(terms);
    }
    const float det = aa * bb - ab * ab;
    if (!(det > 1e-6f * (aa + bb) * (aa + bb))) continue;
    for (int i = 0; i < 16; ++i) terms[i] = ws[i] * target.ends[c][i];
    const float ax = sum_of(terms);
    for (int i = 0; i < 16; ++i) terms[i] = wt[i] * target.ends[c][i];
    const float bx = sum_of(terms);
    made.a[c] = (ax * bb - bx * ab) / det;
    made.b[c] = (bx * aa - ax * ab) / det;
  }
  line = made;
}

std::array<uint8_t, kPartitions> ranked_partitions(const Target& target) {
  const Mean mean = mean_of(target, mask_of(Block{kFirstOneRegion}, 0));
  alignas(32) float moments[16][kMoments];
  float total[kMoments] = {};
  for (int i = 0; i < 16; ++i) {
    const float w = target.texel_fit[i];
    const float x = target.ends[0][i] - mean.at[0], y = target.ends[1][i] - mean.at[1],
                z = target.ends[2][i] - mean.at[2];
    const float terms[kMoments] = {1, x, y, z, x * x, y * y, z * z, x * y, x * z, y * z};
    for (int m = 0; m < kMoments; ++m) {
      moments[i][m] = w * terms[m];
      total[m] += moments[i][m];
    }
  }
  PartitionCosts costs;
  partition_costs(moments, total, costs);
  std::array<uint8_t, kPartitions> ranked;
  for (int p = 0; p < kPartitions; ++p) ranked[p] = static_cast<uint8_t>(p);
  std::sort(ranked.begin(), ranked.end(), [&](uint8_t a, uint8_t b) {
    return costs.of[a] != costs.of[b] ? costs.of[a] < costs.of[b] : a < b;
  });
  return ranked;
}

}  // namespace kiln::bc6h
