#include "coordinator/output/blocks/bc1.h"

#include <algorithm>

#include "coordinator/output/blocks/bc1_clusters.h"
#include "coordinator/output/blocks/lanes.h"

namespace kiln {
namespace {

constexpr int kBits[3] = {5, 6, 5};
constexpr int kTop[3] = {31, 63, 31};

// To the nearest byte: 255 q / 31 and 255 q / 63.
constexpr int expanded(int q, int c) {
  return c == 1 ? (q * 259 + 33) >> 6 : (q * 527 + 23) >> 6;
}
constexpr int third(int near, int far) {
  return (2 * near + far + 1) / 3;
}

struct Bc1Block {
  float error;
  int q[2][3];
  alignas(64) int place[16];  // 0 to 3 thirds of the way from the first end to the second
};

// For each byte, the end points whose value at one third is nearest to it; ties go to the closest pair.
struct SolidEnds {
  uint8_t first[2][256], second[2][256];  // of 5 and 6 bits
  SolidEnds() {
    for (int wide = 0; wide < 2; ++wide) {
      const int top = kTop[wide];
      for (int v = 0; v < 256; ++v) {
        int least = 1 << 20;
        for (int a = 0; a <= top; ++a)
          for (int b = 0; b <= top; ++b) {
            const int off = third(expanded(a, wide), expanded(b, wide)) - v, apart = a < b ? b - a : a - b;
            const int cost = (off < 0 ? -off : off) * 64 + apart;
            if (cost >= least) continue;
            least = cost;
            first[wide][v] = static_cast<uint8_t>(a), second[wide][v] = static_cast<uint8_t>(b);
          }
      }
    }
  }
};

KILN_INLINE bool try_ends(const BlockLanes& lanes, const int (&q)[2][3], Bc1Block& best) {
  float palette[3][4];
  for (int c = 0; c < 3; ++c) {
    const int a = expanded(q[0][c], c), b = expanded(q[1][c], c);
    palette[c][0] = static_cast<float>(a);
    palette[c][1] = static_cast<float>(third(a, b));
    palette[c][2] = static_cast<float>(third(b, a));
    palette[c][3] = static_cast<float>(b);
  }
  alignas(64) int place[16];
  const float error = nearest_of<3, 4>(lanes.v, lanes.channel, lanes.weight, palette, place);
  if (!(error < best.error)) return false;
  best.error = error;
  std::copy_n(&q[0][0], 6, &best.q[0][0]);
  std::copy_n(place, 16, best.place);
  return true;
}

KILN_INLINE void round_ends(const float (*ends)[4], int (&q)[2][3]) {
  for (int e = 0; e < 2; ++e)
    for (int c = 0; c < 3; ++c)
      q[e][c] = static_cast<int>(ends[e][c] * (static_cast<float>(kTop[c]) / 255.0f) + 0.5f);
}

KILN_INLINE void refine(const BlockLanes& lanes, int rounds, Bc1Block& best) {
  for (int round = 0; round < rounds; ++round) {
    alignas(64) float t[16];
    for (int i = 0; i < 16; ++i) t[i] = static_cast<float>(best.place[i]) * (1.0f / 3);
    float ends[2][4];
    for (int e = 0; e < 2; ++e)
      for (int c = 0; c < 3; ++c) ends[e][c] = static_cast<float>(expanded(best.q[e][c], c));
    least_squares_ends<3>(lanes.v, lanes.weight, t, ends);
    int q[2][3];
    round_ends(ends, q);
    if (!try_ends(lanes, q, best)) return;
  }
}

// Single steps of an end in one channel; `pairs`: also of both ends together.
KILN_INLINE bool move_one(const BlockLanes& lanes, bool pairs, Bc1Block& best) {
  bool better = false;
  for (int c = 0; c < 3; ++c)
    for (int which = 1; which <= (pairs ? 3 : 2); ++which)
      for (const int step : {-1, 1}) {
        int q[2][3];
        std::copy_n(&best.q[0][0], 6, &q[0][0]);
        if (which & 1) q[0][c] += step;
        if (which & 2) q[1][c] += step;
        if (std::min(q[0][c], q[1][c]) < 0 || std::max(q[0][c], q[1][c]) > kTop[c]) continue;
        better |= try_ends(lanes, q, best);
      }
  return better;
}

// All neighbours of one end: 3 x 3 x 3 steps.
KILN_INLINE bool move_end(const BlockLanes& lanes, int end, Bc1Block& best) {
  bool better = false;
  for (int n = 0; n < 27; ++n) {
    int q[2][3];
    std::copy_n(&best.q[0][0], 6, &q[0][0]);
    q[end][0] += n % 3 - 1, q[end][1] += n / 3 % 3 - 1, q[end][2] += n / 9 - 1;
    bool inside = true;
    for (int c = 0; c < 3; ++c) inside = inside && q[end][c] >= 0 && q[end][c] <= kTop[c];
    if (inside) better |= try_ends(lanes, q, best);
  }
  return better;
}

KILN_WIDE Bc1Block start(const BlockLanes& lanes) {
  alignas(64) float w[16];
  std::copy_n(lanes.weight, 16, w);
  float ends[2][4] = {};
  principal_ends<3>(lanes.v, lanes.channel, lanes.weight, lane_sum(w), ends);
  Bc1Block best{1e30f, {}, {}};
  int q[2][3];
  round_ends(ends, q);
  try_ends(lanes, q, best);
  refine(lanes, 1, best);
  return best;
}

KILN_WIDE void improve(const BlockLanes& lanes, Bc1Block& best) {
  refine(lanes, 2, best);
  move_one(lanes, false, best);
}

KILN_WIDE void exhaust(const BlockLanes& lanes, Bc1Block& best) {
  for (int round = 0; round < 16; ++round) {
    bool better = move_one(lanes, true, best);
    better |= move_end(lanes, 0, best);
    better |= move_end(lanes, 1, best);
    if (!better) break;
    refine(lanes, 1, best);
  }
}

KILN_WIDE void from_clusters(const BlockLanes& lanes, const float (*ends)[4], Bc1Block& block) {
  int q[2][3];
  round_ends(ends, q);
  try_ends(lanes, q, block);
}

Bc1Block search(const BlockLanes& lanes, BlockEffort effort) {
  Bc1Block best = start(lanes);
  if (effort == BlockEffort::kFast) return best;
  const Bc1Block first = best;
  improve(lanes, best);
  if (effort == BlockEffort::kNormal) return best;
  exhaust(lanes, best);
  // Another start, since steps end in the nearest local minimum.
  float ends[2][4] = {};
  for (int e = 0; e < 2; ++e)
    for (int c = 0; c < 3; ++c) ends[e][c] = static_cast<float>(expanded(first.q[e][c], c));
  cluster_ends(lanes, ends);
  Bc1Block other{1e30f, {}, {}};
  from_clusters(lanes, ends, other);
  exhaust(lanes, other);
  return other.error < best.error ? other : best;
}

bool is_solid(const BlockLanes& lanes, int& texel) {
  texel = 0;
  while (!(lanes.weight[texel] > 0)) ++texel;
  for (int i = texel + 1; i < 16; ++i)
    for (int c = 0; c < 3; ++c)
      if (lanes.weight[i] > 0 && lanes.v[c][i] != lanes.v[c][texel]) return false;
  return true;
}

Bc1Block solid(const BlockLanes& lanes, int texel) {
  static const SolidEnds kEnds;
  Bc1Block block{0, {}, {}};
  for (int c = 0; c < 3; ++c) {
    const int v = static_cast<int>(lanes.v[c][texel] + 0.5f), wide = kBits[c] - 5;
    block.q[0][c] = kEnds.first[wide][v], block.q[1][c] = kEnds.second[wide][v];
  }
  std::fill_n(block.place, 16, 1);
  return block;
}

// Four colours if the first end is the larger number. Maps positions in thirds to codes: the ends are 0 and
// 1.
void pack(Bc1Block b, uint8_t* block) {
  const auto number = [&](int e) {
    return static_cast<unsigned>(b.q[e][0] << 11 | b.q[e][1] << 5 | b.q[e][2]);
  };
  unsigned first = number(0), second = number(1);
  if (first < second) {
    std::swap(first, second);
    for (int& place : b.place) place = 3 - place;
  }
  uint32_t codes = 0;
  constexpr uint32_t kCode[4] = {0, 2, 3, 1};
  if (first != second)  // equal ends give a block of three colours, whose code 0 is the end
    for (int i = 0; i < 16; ++i) codes |= kCode[b.place[i]] << (2 * i);
  const uint32_t words[2] = {first | second << 16, codes};
  for (int i = 0; i < 8; ++i) block[i] = static_cast<uint8_t>(words[i / 4] >> (8 * (i % 4)));
}

}  // namespace

void encode_bc1(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block) {
  const BlockLanes lanes = block_lanes(texels, choice.metric);
  int texel;
  pack(is_solid(lanes, texel) ? solid(lanes, texel) : search(lanes, choice.effort), block);
}

void decode_bc1(const uint8_t* block, BlockTexels& texels) {
  const int first = block[0] | block[1] << 8, second = block[2] | block[3] << 8;
  int colour[4][4] = {};
  for (int c = 0; c < 3; ++c) {
    const int shift = c == 0 ? 11 : c == 1 ? 5 : 0;
    const int a = expanded(first >> shift & kTop[c], c), b = expanded(second >> shift & kTop[c], c);
    colour[0][c] = a, colour[1][c] = b;
    colour[2][c] = first > second ? third(a, b) : (a + b + 1) / 2;
    if (first > second) colour[3][c] = third(b, a);
  }
  for (int k = 0; k < 4; ++k) colour[k][3] = k < 3 || first > second ? 255 : 0;
  for (int i = 0; i < 16; ++i) {
    const int code = block[4 + i / 4] >> (2 * (i % 4)) & 3;
    for (int c = 0; c < 4; ++c) texels.rgba[i][c] = static_cast<float>(colour[code][c]) / 255.0f;
  }
}

}  // namespace kiln
