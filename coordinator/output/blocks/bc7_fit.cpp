#include "coordinator/output/blocks/bc7_fit.h"

#include "coordinator/output/blocks/bc7_tables.h"

namespace kiln {
namespace {

struct Ends {
  int q[2][4];
  int p[2];
};

int with_p(const Bc7Line& line) {
  return line.p == Bc7P::kNone ? 0 : 1;
}

KILN_INLINE int expanded(const Bc7Line& line, int q, int p, int c) {
  return with_p(line) ? bc7_expand(q << 1 | p, line.bits[c] + 1) : bc7_expand(q, line.bits[c]);
}

KILN_INLINE int quantised(const Bc7Line& line, float v, int p, int c) {
  const int top = (1 << line.bits[c]) - 1;
  const float steps = static_cast<float>((1 << (line.bits[c] + with_p(line))) - 1) / 255.0f;
  const float x = with_p(line) ? (v * steps - static_cast<float>(p)) * 0.5f : v * steps;
  return std::clamp(static_cast<int>(x + 0.5f), 0, top);  // x > -0.5
}

// The error from rounding an end alone.
template <int C>
KILN_INLINE float rounding(const Bc7Line& line, const float* channel, const float* end, int p) {
  float error = 0;
  for (int c = 0; c < C; ++c) {
    const float d = end[c] - static_cast<float>(expanded(line, quantised(line, end[c], p, c), p, c));
    error += channel[c] * d * d;
  }
  return error;
}

template <int C>
KILN_INLINE Ends round_ends(const Bc7Line& line, const float (*ends)[4], int p0, int p1) {
  Ends e{};
  e.p[0] = p0, e.p[1] = p1;
  for (int c = 0; c < C; ++c) {
    e.q[0][c] = quantised(line, ends[0][c], p0, c);
    e.q[1][c] = quantised(line, ends[1][c], p1, c);
  }
  return e;
}

template <int C>
KILN_INLINE Ends round_ends(const Bc7Line& line, const float* channel, const float (*ends)[4]) {
  if (line.p == Bc7P::kNone) return round_ends<C>(line, ends, 0, 0);
  if (line.p == Bc7P::kOnes) return round_ends<C>(line, ends, 1, 1);
  float r[2][2];
  for (int e = 0; e < 2; ++e)
    for (int p = 0; p < 2; ++p) r[e][p] = rounding<C>(line, channel, ends[e], p);
  if (line.p == Bc7P::kShared) {
    const int p = r[0][1] + r[1][1] < r[0][0] + r[1][0];
    return round_ends<C>(line, ends, p, p);
  }
  return round_ends<C>(line, ends, r[0][1] < r[0][0], r[1][1] < r[1][0]);
}

template <int C, int K>
KILN_INLINE float measure(const BlockLanes& lanes, const float* weight, const Bc7Line& line, const Ends& e,
                          int* index) {
  constexpr const int* kWeights = bc7_weights(K == 16 ? 4 : K == 8 ? 3 : 2);
  alignas(64) float palette[C][K];
  for (int c = 0; c < C; ++c) {
    const int low = expanded(line, e.q[0][c], e.p[0], c), high = expanded(line, e.q[1][c], e.p[1], c);
    for (int k = 0; k < K; ++k) palette[c][k] = static_cast<float>(bc7_interpolate(low, high, kWeights[k]));
  }
  return nearest_of<C, K>(&lanes.v[line.first], &lanes.channel[line.first], weight, palette, index);
}

struct Best {
  float error;
  Ends ends;
  alignas(64) int index[16];
};

template <int C, int K>
KILN_INLINE bool try_ends(const BlockLanes& lanes, const float* weight, const Bc7Line& line, const Ends& e,
                          Best& best) {
  alignas(64) int index[16];
  const float error = measure<C, K>(lanes, weight, line, e, index);
  if (!(error < best.error)) return false;
  best.error = error;
  best.ends = e;
  std::copy_n(index, 16, best.index);
  return true;
}

// Steps one end, the other, both together; then flips p.
template <int C, int K>
KILN_INLINE bool move_ends(const BlockLanes& lanes, const float* weight, const Bc7Line& line, Best& best) {
  bool better = false;
  for (int c = 0; c < C; ++c) {
    const int top = (1 << line.bits[c]) - 1;
    for (int which = 1; which <= 3; ++which)
      for (const int step : {-1, 1}) {
        Ends e = best.ends;
        if (which & 1) e.q[0][c] += step;
        if (which & 2) e.q[1][c] += step;
        if (std::min(e.q[0][c], e.q[1][c]) < 0 || std::max(e.q[0][c], e.q[1][c]) > top) continue;
        better |= try_ends<C, K>(lanes, weight, line, e, best);
      }
  }
  if (line.p == Bc7P::kShared || line.p == Bc7P::kUnique)
    for (int flip = line.p == Bc7P::kShared ? 3 : 1; flip <= 3; ++flip) {
      Ends e = best.ends;
      e.p[0] ^= flip & 1;
      e.p[1] ^= flip >> 1;
      better |= try_ends<C, K>(lanes, weight, line, e, best);
    }
  return better;
}

template <int C, int K>
KILN_INLINE Bc7Fit fit(const BlockLanes& lanes, const float* weight, const Bc7Line& line, int rounds,
                       int moves) {
  Bc7Fit result;
  alignas(64) float w[16];
  std::copy_n(weight, 16, w);
  const float total = lane_sum(w);
  if (!(total > 0)) return result;
  const float(*v)[16] = &lanes.v[line.first];
  const float* channel = &lanes.channel[line.first];
  constexpr const int* kWeights = bc7_weights(K == 16 ? 4 : K == 8 ? 3 : 2);
  float ends[2][4] = {};
  principal_ends<C>(v, channel, weight, total, ends);
  Best best{1e30f, {}, {}};
  alignas(64) int index[16];
  for (int round = 0;; ++round) {
    const Ends e = round_ends<C>(line, channel, ends);
    const float error = measure<C, K>(lanes, weight, line, e, index);
    const bool better = error < best.error;
    if (better) {
      best.error = error;
      best.ends = e;
      std::copy_n(index, 16, best.index);
    }
    if (round == rounds || !better) break;
    alignas(64) float t[16];
    for (int i = 0; i < 16; ++i) t[i] = static_cast<float>(kWeights[index[i]]) * (1.0f / 64);
    least_squares_ends<C>(v, weight, t, ends);
  }
  while (moves-- > 0 && best.error > 0)
    if (!move_ends<C, K>(lanes, weight, line, best)) break;
  result.error = best.error;
  for (int e = 0; e < 2; ++e) {
    result.p[e] = static_cast<uint8_t>(best.ends.p[e]);
    for (int c = 0; c < C; ++c) result.ends[e][c] = static_cast<uint8_t>(best.ends.q[e][c]);
  }
  for (int i = 0; i < 16; ++i) result.index[i] = static_cast<uint8_t>(best.index[i]);
  return result;
}

// One instantiation per shape in use, so that loops have fixed bounds.
#define KILN_BC7_FIT(C, K)                                                                          \
  KILN_WIDE Bc7Fit fit_##C##_##K(const BlockLanes& lanes, const float* weight, const Bc7Line& line, \
                                 int rounds, int moves) {                                           \
    return fit<C, K>(lanes, weight, line, rounds, moves);                                           \
  }
KILN_BC7_FIT(1, 4)
KILN_BC7_FIT(1, 8)
KILN_BC7_FIT(3, 4)
KILN_BC7_FIT(3, 8)
KILN_BC7_FIT(3, 16)
KILN_BC7_FIT(4, 4)
KILN_BC7_FIT(4, 16)
#undef KILN_BC7_FIT

}  // namespace

Bc7Fit fit_bc7(const BlockLanes& lanes, const float* weight, const Bc7Line& line, int rounds, int moves) {
  if (line.channels == 1)
    return (line.index_bits == 3 ? fit_1_8 : fit_1_4)(lanes, weight, line, rounds, moves);
  if (line.channels == 4)
    return (line.index_bits == 4 ? fit_4_16 : fit_4_4)(lanes, weight, line, rounds, moves);
  return (line.index_bits == 4   ? fit_3_16
          : line.index_bits == 3 ? fit_3_8
                                 : fit_3_4)(lanes, weight, line, rounds, moves);
}

}  // namespace kiln
