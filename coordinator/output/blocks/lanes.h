// A block of texels by channel, for arithmetic on 16 texels at once, and the sums used to fit lines. Sums use
// a fixed tree, so that they do not depend on the instruction set. Functions are inlined into those that are
// compiled for wide registers (common/base/wide.h).
#pragma once

#include <algorithm>
#include <cmath>

#include "common/base/wide.h"
#include "coordinator/output/blocks/blocks.h"

namespace kiln {

struct BlockLanes {
  alignas(64) float v[4][16];    // by channel, 0 to 255
  alignas(64) float weight[16];  // at most 1; not all are 0
  float channel[4];              // weights of channels in the squared error
};

// 1 for each colour, or shares of the luminance that sum to 3 (Rec. 709); alpha 1.
BlockLanes block_lanes(const BlockTexels& texels, BlockMetric metric);

// Written with vectors of four, available on any x86-64: otherwise the compiler adds shuffles.
using Four = float __attribute__((vector_size(16)));

KILN_INLINE Four four_at(const float* x) {
  Four v;
  __builtin_memcpy(&v, x, sizeof v);
  return v;
}

KILN_INLINE float lane_sum(const float* x) {
  const Four s = (four_at(x) + four_at(x + 8)) + (four_at(x + 4) + four_at(x + 12));
  return (s[0] + s[2]) + (s[1] + s[3]);
}

KILN_INLINE float lane_dot(const float* x, const float* y) {
  const Four s = (four_at(x) * four_at(y) + four_at(x + 8) * four_at(y + 8)) +
                 (four_at(x + 4) * four_at(y + 4) + four_at(x + 12) * four_at(y + 12));
  return (s[0] + s[2]) + (s[1] + s[3]);
}

KILN_INLINE float in_byte(float v) {
  return v < 0.0f ? 0.0f : v > 255.0f ? 255.0f : v;
}

// The end points, in 0 to 255, of the weighted texels' extent along their principal axis, for channels 0 to C
// - 1 of v. The axis is the dominant eigenvector of the covariance, by power iteration from its largest
// column.
template <int C>
KILN_INLINE void principal_ends(const float (*v)[16], const float* channel, const float* weight, float total,
                                float (*ends)[4]) {
  float mean[C], root[C];
  alignas(64) float d[C][16], dw[16];
  for (int c = 0; c < C; ++c) {
    mean[c] = lane_dot(v[c], weight) / total;
    root[c] = std::sqrt(channel[c]);
    for (int i = 0; i < 16; ++i) d[c][i] = (v[c][i] - mean[c]) * root[c];
  }
  float m[C][C];
  for (int a = 0; a < C; ++a) {
    for (int i = 0; i < 16; ++i) dw[i] = d[a][i] * weight[i];
    for (int b = a; b < C; ++b) m[a][b] = m[b][a] = lane_dot(dw, d[b]);
  }
  int first = 0;
  for (int c = 1; c < C; ++c)
    if (m[c][c] > m[first][first]) first = c;
  float axis[C];
  for (int c = 0; c < C; ++c) axis[c] = m[first][c];
  for (int round = 0; round < 6; ++round) {
    float next[C], largest = 0;
    for (int a = 0; a < C; ++a) {
      next[a] = 0;
      for (int b = 0; b < C; ++b) next[a] += m[a][b] * axis[b];
      largest = std::max(largest, next[a] < 0 ? -next[a] : next[a]);
    }
    const float scale = largest > 0 ? 1.0f / largest : 0.0f;
    for (int a = 0; a < C; ++a) axis[a] = next[a] * scale;
  }
  float length = 0;
  for (int c = 0; c < C; ++c) length += axis[c] * axis[c];
  const float inverse = length > 0 ? 1.0f / length : 0.0f;
  alignas(64) float low[16], high[16];
  for (int i = 0; i < 16; ++i) {
    float t = 0;
    for (int c = 0; c < C; ++c) t += d[c][i] * axis[c];
    t = weight[i] > 0 ? t * inverse : 0.0f;  // the mean is inside the extent
    low[i] = high[i] = t;
  }
  for (int step = 8; step > 0; step /= 2)
    for (int i = 0; i < step; ++i) {
      low[i] = low[i + step] < low[i] ? low[i + step] : low[i];
      high[i] = high[i + step] > high[i] ? high[i + step] : high[i];
    }
  for (int c = 0; c < C; ++c) {
    const float slope = root[c] > 0 ? axis[c] / root[c] : 0.0f;
    ends[0][c] = in_byte(mean[c] + low[0] * slope);
    ends[1][c] = in_byte(mean[c] + high[0] * slope);
  }
}

// Nearest of K palette entries for each texel; returns the weighted squared error.
template <int C, int K>
KILN_INLINE float nearest_of(const float (*v)[16], const float* channel, const float* weight,
                             const float (&palette)[C][K], int* index) {
  alignas(64) float best[16], error[16];
  alignas(64) int at[16];
  for (int i = 0; i < 16; ++i) best[i] = 1e30f, at[i] = 0;
  for (int k = 0; k < K; ++k)
    for (int i = 0; i < 16; ++i) {
      float sum = 0;
      for (int c = 0; c < C; ++c) {
        const float t = v[c][i] - palette[c][k];
        sum += channel[c] * (t * t);
      }
      at[i] = sum < best[i] ? k : at[i];
      best[i] = sum < best[i] ? sum : best[i];
    }
  for (int i = 0; i < 16; ++i) error[i] = best[i] * weight[i], index[i] = at[i];
  return lane_sum(error);
}

// Least squares: the end points a, b whose mixtures (1 - t) a + t b are nearest to the texels. Leaves the end
// points unchanged if all texels have the same t.
template <int C>
KILN_INLINE void least_squares_ends(const float (*v)[16], const float* weight, const float* t,
                                    float (*ends)[4]) {
  alignas(64) float a[16], b[16], s[16];
  for (int i = 0; i < 16; ++i) {
    s[i] = 1.0f - t[i];
    a[i] = weight[i] * s[i];
    b[i] = weight[i] * t[i];
  }
  const float aa = lane_dot(a, s), ab = lane_dot(a, t), bb = lane_dot(b, t);
  const float det = aa * bb - ab * ab;
  if (!(det > 1e-4f * (aa + bb) * (aa + bb))) return;
  const float inverse = 1.0f / det;
  for (int c = 0; c < C; ++c) {
    const float x = lane_dot(a, v[c]), y = lane_dot(b, v[c]);
    ends[0][c] = in_byte((bb * x - ab * y) * inverse);
    ends[1][c] = in_byte((aa * y - ab * x) * inverse);
  }
}

}  // namespace kiln
