#include "coordinator/output/blocks/bc7_partition_bound.h"

#include "coordinator/output/blocks/bc7_tables.h"

namespace kiln {
namespace {

constexpr int kPartitions = 64;

// 1 where the texel belongs to the subset: by subset - 1, texel, partition.
struct Membership {
  alignas(64) float of[2][16][kPartitions];
};

Membership membership(int subsets) {
  Membership m{};
  for (size_t p = 0; p < kPartitions; ++p)
    for (size_t i = 0; i < 16; ++i) {
      const int s = bc7_partitions(subsets)[p].subset[i];
      if (s > 0) m.of[s - 1][i][p] = 1;
    }
  return m;
}

// 1, the channels, and their products, whose sums over a subset give its covariance.
template <int C>
constexpr int kMoments = 1 + C + C*(C + 1) / 2;

template <int C>
KILN_INLINE void moments_of(const BlockLanes& lanes, float (*m)[16]) {
  const float total = [&] {
    alignas(64) float w[16];
    for (int i = 0; i < 16; ++i) w[i] = lanes.weight[i];
    return lane_sum(w);
  }();
  alignas(64) float d[C][16];
  for (int c = 0; c < C; ++c) {
    const float mean = lane_dot(lanes.v[c], lanes.weight) / total, root = std::sqrt(lanes.channel[c]);
    for (int i = 0; i < 16; ++i) d[c][i] = (lanes.v[c][i] - mean) * root;
  }
  for (int i = 0; i < 16; ++i) m[0][i] = lanes.weight[i];
  for (int c = 0; c < C; ++c)
    for (int i = 0; i < 16; ++i) m[1 + c][i] = lanes.weight[i] * d[c][i];
  int k = 1 + C;
  for (int a = 0; a < C; ++a)
    for (int b = a; b < C; ++b, ++k)
      for (int i = 0; i < 16; ++i) m[k][i] = lanes.weight[i] * d[a][i] * d[b][i];
}

template <int C>
constexpr int place(int a, int b) {  // of a product in the upper triangle
  const int low = a < b ? a : b, high = a < b ? b : a;
  return low * C - low * (low - 1) / 2 + high - low;
}

// Adds one subset of all partitions to the bound. tr(M^5) / tr(M^4) approximates the largest eigenvalue:
// exact for one direction, and for equal ones; else too small by less than a tenth of the other eigenvalues.
template <int C>
KILN_INLINE void add_subset(const float (*sums)[kPartitions], float along, Bc7PartitionBound& promise) {
  constexpr int kPairs = C * (C + 1) / 2;
  for (int p = 0; p < kPartitions; ++p) {
    const float n = sums[0][p], inverse = n > 0 ? 1.0f / n : 0.0f;
    float m[kPairs], square[kPairs], fourth[kPairs];
    for (int a = 0; a < C; ++a)
      for (int b = a; b < C; ++b)
        m[place<C>(a, b)] = sums[1 + C + place<C>(a, b)][p] - sums[1 + a][p] * sums[1 + b][p] * inverse;
    for (int a = 0; a < C; ++a)
      for (int b = a; b < C; ++b) {
        float s = 0;
        for (int k = 0; k < C; ++k) s += m[place<C>(a, k)] * m[place<C>(k, b)];
        square[place<C>(a, b)] = s;
      }
    for (int a = 0; a < C; ++a)
      for (int b = a; b < C; ++b) {
        float s = 0;
        for (int k = 0; k < C; ++k) s += square[place<C>(a, k)] * square[place<C>(k, b)];
        fourth[place<C>(a, b)] = s;
      }
    float trace = 0, trace4 = 0, trace5 = 0;
    for (int a = 0; a < C; ++a) {
      trace += m[place<C>(a, a)];
      trace4 += fourth[place<C>(a, a)];
      for (int b = 0; b < C; ++b) trace5 += fourth[place<C>(a, b)] * m[place<C>(a, b)];
    }
    const float largest = trace4 > 0 ? trace5 / trace4 : 0.0f;
    const float rest = trace - largest > 0 ? trace - largest : 0.0f;
    promise.least[p] += rest;
    promise.expected[p] += rest + along * largest;
  }
}

template <int C>
KILN_INLINE Bc7PartitionBound promise_of(const BlockLanes& lanes, const Membership& member, int subsets,
                                         int index_bits) {
  constexpr int kCount = kMoments<C>;
  alignas(64) float m[kCount][16], sums[3][kCount][kPartitions];
  moments_of<C>(lanes, m);
  for (int k = 0; k < kCount; ++k) {
    for (int s = 1; s < subsets; ++s) {
      for (int p = 0; p < kPartitions; ++p) sums[s][k][p] = 0;
      for (int i = 0; i < 16; ++i)
        for (int p = 0; p < kPartitions; ++p) sums[s][k][p] += member.of[s - 1][i][p] * m[k][i];
    }
    const float all = lane_sum(m[k]);
    for (int p = 0; p < kPartitions; ++p)
      sums[0][k][p] = subsets == 3 ? all - sums[1][k][p] - sums[2][k][p] : all - sums[1][k][p];
  }
  Bc7PartitionBound promise{};
  // Values uniform over a line have variance extent^2 / 12, and the quantisation error is that of one step.
  const auto steps = static_cast<float>((1 << index_bits) - 1);
  for (int s = 0; s < subsets; ++s) add_subset<C>(sums[s], 1.0f / (steps * steps), promise);
  return promise;
}

KILN_WIDE Bc7PartitionBound promise_3(const BlockLanes& lanes, const Membership& member, int subsets,
                                      int index_bits) {
  return promise_of<3>(lanes, member, subsets, index_bits);
}
KILN_WIDE Bc7PartitionBound promise_4(const BlockLanes& lanes, const Membership& member, int subsets,
                                      int index_bits) {
  return promise_of<4>(lanes, member, subsets, index_bits);
}

}  // namespace

Bc7PartitionBound bc7_partition_bound(const BlockLanes& lanes, int channels, int subsets, int index_bits) {
  static const Membership kTwo = membership(2), kThree = membership(3);
  const Membership& member = subsets == 3 ? kThree : kTwo;
  return (channels == 4 ? promise_4 : promise_3)(lanes, member, subsets, index_bits);
}

int take_best(Bc7PartitionBound& promise, int count) {
  int best = 0;
  for (int p = 1; p < count; ++p)
    if (promise.expected[p] < promise.expected[best]) best = p;
  promise.expected[best] = 3e38f;
  return best;
}

}  // namespace kiln
