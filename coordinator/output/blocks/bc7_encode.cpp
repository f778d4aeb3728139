#include <algorithm>

#include "coordinator/output/blocks/bc7.h"
#include "coordinator/output/blocks/bc7_candidate.h"
#include "coordinator/output/blocks/bc7_fit.h"
#include "coordinator/output/blocks/bc7_partition_bound.h"
#include "coordinator/output/blocks/bc7_tables.h"

namespace kiln {
namespace {

struct Search {
  const BlockLanes& lanes;
  bool alpha;
  float floor;  // the error of the texels rounded to bytes
  Bc7Candidate best;

  // Stop when the error is close to that of rounding.
  bool done(float slack) const { return best.error <= slack * floor; }
};

void keep(Bc7Candidate& best, const Bc7Candidate& candidate) {
  if (candidate.error < best.error) best = candidate;
}

void put_fit(const Bc7Fit& fit, int subset, int first, int channels, Bc7Candidate& candidate) {
  candidate.error += fit.error;
  for (int e = 0; e < 2; ++e) {
    candidate.p[subset][e] = fit.p[e];
    for (int c = 0; c < channels; ++c) candidate.ends[subset][e][first + c] = fit.ends[e][c];
  }
}

float rounding_floor(const BlockLanes& lanes, int channels) {
  alignas(64) float error[16];
  for (int i = 0; i < 16; ++i) {
    error[i] = 0;
    for (int c = 0; c < channels; ++c) {
      const float d = lanes.v[c][i] - static_cast<float>(static_cast<int>(lanes.v[c][i] + 0.5f));
      error[i] += lanes.channel[c] * d * d * lanes.weight[i];
    }
  }
  return lane_sum(error);
}

// Texels whose alpha rounds to 255 are opaque, which also allows modes 0 to 3.
bool has_alpha(const BlockLanes& lanes) {
  for (int i = 0; i < 16; ++i)
    if (lanes.weight[i] > 0 && lanes.v[3][i] < 254.5f) return true;
  return false;
}

bool is_solid(const BlockLanes& lanes, int channels, int& texel) {
  texel = 0;
  while (!(lanes.weight[texel] > 0)) ++texel;
  for (int i = texel + 1; i < 16; ++i)
    if (lanes.weight[i] > 0)
      for (int c = 0; c < channels; ++c)
        if (lanes.v[c][i] != lanes.v[c][texel]) return false;
  return true;
}

// Mode 5 represents every 8-bit colour: all texels use the second of four levels between two 7-bit ends; the
// closest pair is used.
struct SolidEnds {
  uint8_t low[256] = {}, high[256] = {};
  SolidEnds() {
    int apart[256];
    std::fill_n(apart, 256, 1000);
    for (int a = 0; a < 128; ++a)
      for (int b = 0; b < 128; ++b) {
        const int v = bc7_interpolate(bc7_expand(a, 7), bc7_expand(b, 7), kBc7Weights2[1]);
        const int distance = a < b ? b - a : a - b;
        if (distance >= apart[v]) continue;
        apart[v] = distance;
        low[v] = static_cast<uint8_t>(a), high[v] = static_cast<uint8_t>(b);
      }
  }
};

Bc7Candidate solid(const BlockLanes& lanes, int texel, bool alpha) {
  static const SolidEnds kEnds;
  Bc7Candidate k;
  k.mode = 5;
  for (int c = 0; c < 3; ++c) {
    const int v = static_cast<int>(lanes.v[c][texel] + 0.5f);
    k.ends[0][0][c] = kEnds.low[v], k.ends[0][1][c] = kEnds.high[v];
  }
  for (uint8_t& index : k.index) index = 1;
  const int a = alpha ? static_cast<int>(lanes.v[3][texel] + 0.5f) : 255;
  k.ends[0][0][3] = k.ends[0][1][3] = static_cast<uint8_t>(a);
  return k;
}

Bc7Candidate mode6(const Search& s, int rounds, int moves) {
  Bc7Candidate k;
  k.mode = 6;
  const Bc7Line line =
      s.alpha ? Bc7Line{0, 4, {7, 7, 7, 7}, Bc7P::kUnique, 4} : Bc7Line{0, 3, {7, 7, 7, 0}, Bc7P::kOnes, 4};
  const Bc7Fit fit = fit_bc7(s.lanes, s.lanes.weight, line, rounds, moves);
  put_fit(fit, 0, 0, line.channels, k);
  if (!s.alpha) k.ends[0][0][3] = k.ends[0][1][3] = 127;
  std::copy_n(fit.index, 16, k.index);
  return k;
}

// Modes of several subsets: 0 to 3 and 7. Stops when the error of the subsets so far exceeds the best
// block's.
Bc7Candidate partitioned(const Search& s, int mode, int partition, int rounds, int moves, float limit) {
  const Bc7Mode& m = kBc7Modes[mode];
  const Bc7P p = m.unique_p ? Bc7P::kUnique : m.shared_p ? Bc7P::kShared : Bc7P::kNone;
  const Bc7Line line{
      0, m.alpha_bits ? 4 : 3, {m.colour_bits, m.colour_bits, m.colour_bits, m.alpha_bits}, p, m.index_bits};
  Bc7Candidate k;
  k.mode = static_cast<uint8_t>(mode);
  k.partition = static_cast<uint8_t>(partition);
  const auto& subset = bc7_partitions(m.subsets)[static_cast<size_t>(partition)].subset;
  for (int part = 0; part < m.subsets && k.error < limit; ++part) {
    alignas(64) float weight[16];
    for (size_t i = 0; i < 16; ++i) weight[i] = subset[i] == part ? s.lanes.weight[i] : 0.0f;
    const Bc7Fit fit = fit_bc7(s.lanes, weight, line, rounds, moves);
    put_fit(fit, part, 0, line.channels, k);
    for (size_t i = 0; i < 16; ++i)
      if (subset[i] == part) k.index[i] = fit.index[i];
  }
  return k;
}

// Modes 4 and 5: three channels on a line, the fourth separate. Rotation swaps alpha with a colour.
Bc7Candidate separate(const Search& s, int mode, int rotation, int selector, int rounds, int moves,
                      float limit) {
  const Bc7Mode& m = kBc7Modes[mode];
  BlockLanes turned = s.lanes;
  if (!s.alpha) std::fill_n(turned.v[3], 16, 255.0f);
  if (rotation) {
    std::swap_ranges(turned.v[3], turned.v[3] + 16, turned.v[rotation - 1]);
    std::swap(turned.channel[3], turned.channel[rotation - 1]);
  }
  const int first = m.index_bits, second = m.index2_bits;
  const Bc7Line colours{
      0, 3, {m.colour_bits, m.colour_bits, m.colour_bits, 0}, Bc7P::kNone, selector ? second : first};
  const Bc7Line alone{3, 1, {m.alpha_bits, 0, 0, 0}, Bc7P::kNone, selector ? first : second};
  Bc7Candidate k;
  k.mode = static_cast<uint8_t>(mode);
  k.rotation = static_cast<uint8_t>(rotation);
  k.selector = static_cast<uint8_t>(selector);
  const Bc7Fit alpha = fit_bc7(turned, turned.weight, alone, rounds, moves);
  put_fit(alpha, 0, 3, 1, k);
  std::copy_n(alpha.index, 16, k.index2);
  if (k.error >= limit) return k;
  const Bc7Fit fit = fit_bc7(turned, turned.weight, colours, rounds, moves);
  put_fit(fit, 0, 0, 3, k);
  std::copy_n(fit.index, 16, k.index);
  return k;
}

// Single steps of end points are tried only if the error before is at most this factor above the best.
constexpr float kWorthMoving = 1.12f;

void try_separate(Search& s, int mode, int rotation, int selector, int rounds, int moves) {
  const Bc7Candidate plain = separate(s, mode, rotation, selector, rounds, 0, kWorthMoving * s.best.error);
  keep(s.best, plain);
  if (moves > 0 && plain.error < kWorthMoving * s.best.error)
    keep(s.best, separate(s, mode, rotation, selector, rounds, moves, s.best.error));
}

void try_partitions(Search& s, int mode, Bc7PartitionBound promise, int count, int rounds, int moves) {
  const int partitions = 1 << kBc7Modes[mode].partition_bits;
  for (int n = 0; n < count; ++n) {
    const int p = take_best(promise, partitions);
    if (promise.least[p] < s.best.error) keep(s.best, partitioned(s, mode, p, rounds, moves, s.best.error));
  }
}

void search_normal(Search& s) {
  constexpr float kSlack = 1.1f;
  keep(s.best, mode6(s, 3, 0));
  if (s.done(kSlack)) return;
  const int channels = s.alpha ? 4 : 3;
  for (int rotation = s.alpha ? 0 : 1; rotation < 4; ++rotation) try_separate(s, 5, rotation, 0, 2, 0);
  const Bc7PartitionBound two = bc7_partition_bound(s.lanes, channels, 2, s.alpha ? 2 : 3);
  if (s.alpha) {
    try_partitions(s, 7, two, 4, 2, 0);
    return;
  }
  try_partitions(s, 1, two, 4, 2, 0);
  try_partitions(s, 3, two, 2, 2, 0);
}

// Repeats the best block's mode, with single steps while they help.
void polish(Search& s, int rounds) {
  constexpr int kMoves = 16;
  const Bc7Candidate k = s.best;
  keep(s.best, k.mode == 6 ? mode6(s, rounds, kMoves)
               : k.mode == 4 || k.mode == 5
                   ? separate(s, k.mode, k.rotation, k.selector, rounds, kMoves, k.error)
                   : partitioned(s, k.mode, k.partition, rounds, kMoves, k.error));
}

void search_best(Search& s) {
  constexpr int kMoves = 1;  // during the comparison of candidates
  constexpr float kSlack = 1.0001f;
  keep(s.best, mode6(s, 6, kMoves));
  for (int rotation = 0; rotation < 4 && !s.done(kSlack); ++rotation) {
    try_separate(s, 5, rotation, 0, 4, kMoves);
    try_separate(s, 4, rotation, 0, 4, kMoves);
    try_separate(s, 4, rotation, 1, 4, kMoves);
  }
  if (s.done(kSlack)) return;
  const int channels = s.alpha ? 4 : 3;
  if (s.alpha) {
    try_partitions(s, 7, bc7_partition_bound(s.lanes, channels, 2, 2), 24, 3, kMoves);
  } else {
    try_partitions(s, 1, bc7_partition_bound(s.lanes, channels, 2, 3), 8, 2, kMoves);
    try_partitions(s, 3, bc7_partition_bound(s.lanes, channels, 2, 2), 5, 2, kMoves);
    try_partitions(s, 0, bc7_partition_bound(s.lanes, channels, 3, 3), 4, 2, kMoves);
    try_partitions(s, 2, bc7_partition_bound(s.lanes, channels, 3, 2), 6, 2, kMoves);
  }
  polish(s, 3);
}

}  // namespace

void encode_bc7(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block) {
  const BlockLanes lanes = block_lanes(texels, choice.metric);
  const bool alpha = choice.alpha && has_alpha(lanes);
  int texel;
  if (is_solid(lanes, alpha ? 4 : 3, texel)) {
    pack_bc7(solid(lanes, texel, alpha), block);
    return;
  }
  Search s{lanes, alpha, rounding_floor(lanes, alpha ? 4 : 3), {}};
  s.best = mode6(s, 1, 0);
  if (choice.effort != BlockEffort::kFast) search_normal(s);
  if (choice.effort == BlockEffort::kBest) search_best(s);
  pack_bc7(s.best, block);
}

}  // namespace kiln
