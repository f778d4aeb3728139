#include "coordinator/output/blocks/bc4_channel.h"

#include <algorithm>
#include <cmath>

#include "coordinator/output/blocks/lanes.h"

namespace kiln {
namespace {

// The palette that the ends select.
enum class Values : uint8_t {
  kEight,  // from end to end
  kSix,    // from end to end, then bottom and top of the range
};

// Values and ends are in steps of the ends from the bottom of the range, which is 0: 255ths unsigned, 127ths
// signed.
struct Channel {
  alignas(64) float v[1][16];
  alignas(64) float weight[16];  // at most 1; not all are 0
  float total;                   // of the weights
  int top;                       // 255; 254 with sign
};

struct Bc4Block {
  float error;  // weighted squares, in steps
  int low, high;
  Values values;
  alignas(64) int place[16];  // sevenths from low to high; with six values fifths, then 6: bottom, 7: top
};

Channel channel_of(const BlockTexels& texels, int channel, bool is_signed) {
  Channel c;
  c.top = is_signed ? 254 : 255;
  float most = 0;
  for (const float weight : texels.weight) most = std::max(most, weight);
  for (int i = 0; i < 16; ++i) {
    const float v = texels.rgba[i][channel];
    c.v[0][i] = in_byte(is_signed ? 127.0f * v + 127.0f : 255.0f * v);
    c.weight[i] = most > 0 ? std::max(0.0f, texels.weight[i]) / most : 1.0f;
  }
  c.total = lane_sum(c.weight);
  return c;
}

// Finds the nearest value of each texel; returns the error. Ends may lie between steps, because boxes of ends
// are evaluated at their centres.
KILN_INLINE float measure(const Channel& c, float low, float high, Values values, int* place) {
  const bool six = values == Values::kSix;
  const float parts = six ? 5.0f : 7.0f, scale = high > low ? parts / (high - low) : 0.0f;
  const auto top = static_cast<float>(c.top);
  alignas(64) float error[16];
  for (int i = 0; i < 16; ++i) {
    const float v = c.v[0][i];
    float t = (v - low) * scale;
    t = t < 0.0f ? 0.0f : t > parts ? parts : t;
    int k = static_cast<int>(t + 0.5f);
    t = static_cast<float>(k);
    const float d = v - ((parts - t) * low + t * high) / parts;
    float e = d * d;
    if (six) {
      const float far = top - v, to_bottom = v * v, to_top = far * far;
      k = to_bottom < e ? 6 : k;
      e = to_bottom < e ? to_bottom : e;
      k = to_top < e ? 7 : k;
      e = to_top < e ? to_top : e;
    }
    place[i] = k;
    error[i] = e * c.weight[i];
  }
  return lane_sum(error);
}

// Eight values need two different ends: equal ends are written as six values, which include theirs.
KILN_INLINE bool try_ends(const Channel& c, int low, int high, Bc4Block& best) {
  if (low < 0 || high > c.top || low > high) return false;
  if (low == high && best.values == Values::kEight) return false;
  alignas(64) int place[16];
  const float error = measure(c, static_cast<float>(low), static_cast<float>(high), best.values, place);
  if (!(error < best.error)) return false;
  best.error = error, best.low = low, best.high = high;
  std::copy_n(place, 16, best.place);
  return true;
}

KILN_INLINE int nearest_step(float v) {
  return static_cast<int>(v + 0.5f);
}

KILN_INLINE void refine(const Channel& c, int rounds, Bc4Block& best) {
  const int parts = best.values == Values::kEight ? 7 : 5;
  for (int round = 0; round < rounds; ++round) {
    alignas(64) float t[16], weight[16];
    for (int i = 0; i < 16; ++i) {
      const bool between = best.place[i] <= parts;
      t[i] = between ? static_cast<float>(best.place[i]) / static_cast<float>(parts) : 0.0f;
      weight[i] = between ? c.weight[i] : 0.0f;
    }
    float ends[2][4] = {{static_cast<float>(best.low)}, {static_cast<float>(best.high)}};
    least_squares_ends<1>(c.v, weight, t, ends);
    const int high = std::min(nearest_step(ends[1][0]), c.top);
    if (!try_ends(c, nearest_step(ends[0][0]), high, best)) return;
  }
}

// Starts from the smallest and the largest value; for six values, without those that round to the bottom or
// the top.
KILN_WIDE Bc4Block start(const Channel& c, Values values) {
  const auto top = static_cast<float>(c.top);
  const float margin = values == Values::kSix ? 0.5f : 0.0f;
  float low = top, high = 0;
  for (int i = 0; i < 16; ++i) {
    const float v = c.v[0][i];
    if (!(c.weight[i] > 0) || v < margin || v > top - margin) continue;
    low = std::min(low, v), high = std::max(high, v);
  }
  if (low > high) low = 0, high = top;  // only bottom and top occur
  Bc4Block best{1e30f, 0, c.top, values, {}};
  int first = nearest_step(low), last = nearest_step(high);
  if (first == last && values == Values::kEight) first > 0 ? --first : ++last;
  try_ends(c, first, last, best);
  refine(c, 1, best);
  return best;
}

// Least squares ends in the nearest local minimum, and there are many: other starts move both ends in or out
// by quarters of a level.
KILN_WIDE void improve(const Channel& c, Bc4Block& best) {
  const auto low = static_cast<float>(best.low), high = static_cast<float>(best.high);
  const float quarter = (high - low) / (best.values == Values::kSix ? 20.0f : 28.0f);
  for (int i = -1; i <= 2; ++i)
    for (int j = -1; j <= 2; ++j)
      try_ends(c, nearest_step(in_byte(low + static_cast<float>(i) * quarter)),
               nearest_step(in_byte(high - static_cast<float>(j) * quarter)), best);
  refine(c, 3, best);
  constexpr int kMoves[8][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, 1}, {-1, 1}, {1, -1}};
  for (int round = 0; round < 16; ++round) {
    bool better = false;
    for (const auto& move : kMoves) better |= try_ends(c, best.low + move[0], best.high + move[1], best);
    if (!better) return;
  }
}

// Twice the single-precision error of a root mean square from measure(), in steps: values, differences and
// texels are rounded by 2^-17 each; at a tie a level is misjudged by 7 * 3 * 2^-24 + 2^-22, which costs twice
// as much of 255 / 7 steps; six roundings of the sum are halved by the root, of 128 at most. Together below
// 2e-4, for the result and for the value it is compared with.
constexpr float kSlack = 4e-4f;

// Branch and bound over all ends that can beat `best`. Moving the ends by up to r steps moves no value by
// more, so neither a texel's distance to its nearest value nor the weighted root mean square changes by more
// (triangle inequality). A box of ends whose centre exceeds the best error by its radius therefore contains
// no better ends; other boxes are quartered.
KILN_WIDE void exhaust(const Channel& c, Bc4Block& best) {
  struct Box {
    int low, high, side;
  };
  Box stack[32];  // 8 levels, each of which leaves 3
  int count = 0;
  stack[count++] = {0, 0, 256};
  while (count > 0) {
    const auto [low, high, side] = stack[--count];
    if (side == 1) {
      try_ends(c, low, high, best);
      continue;
    }
    if (low > c.top || high > c.top || low >= high + side) continue;
    const float radius = 0.5f * static_cast<float>(side - 1);
    alignas(64) int place[16];
    const float error =
        measure(c, static_cast<float>(low) + radius, static_cast<float>(high) + radius, best.values, place);
    const float reach = std::sqrt(best.error / c.total) + radius + kSlack;
    if (error > c.total * reach * reach) continue;
    const int half = side / 2;
    for (int k = 0; k < 4; ++k) stack[count++] = {low + k % 2 * half, high + k / 2 * half, half};
  }
}

Bc4Block search(const Channel& c, BlockEffort effort) {
  Bc4Block eight = start(c, Values::kEight), six = start(c, Values::kSix);
  if (effort != BlockEffort::kFast) improve(c, eight), improve(c, six);
  if (effort == BlockEffort::kBest) {
    // The error of one palette bounds the other.
    Bc4Block& other = eight.error < six.error ? six : eight;
    Bc4Block& better = eight.error < six.error ? eight : six;
    exhaust(c, better);
    other.error = std::min(other.error, better.error);
    const float bound = other.error;
    exhaust(c, other);
    return other.error < bound ? other : better;
  }
  return six.error < eight.error ? six : eight;
}

bool is_solid(const Channel& c, float& value) {
  int texel = 0;
  while (!(c.weight[texel] > 0)) ++texel;
  value = c.v[0][texel];
  for (int i = texel + 1; i < 16; ++i)
    if (c.weight[i] > 0 && c.v[0][i] != value) return false;
  return true;
}

// Ends one step apart give every seventh (with six values: fifth) of a step between them, and no ends give
// others.
Bc4Block solid(const Channel& c, float value) {
  Bc4Block best{1e30f, 0, 0, Values::kEight, {}};
  for (const Values values : {Values::kEight, Values::kSix}) {
    const int parts = values == Values::kEight ? 7 : 5;
    const int number = nearest_step(value * static_cast<float>(parts));
    const float off = static_cast<float>(number) / static_cast<float>(parts) - value, error = off * off;
    if (!(error < best.error)) continue;
    const int low = std::min(number / parts, c.top - 1);
    best.error = error, best.low = low, best.high = low + 1, best.values = values;
    std::fill_n(best.place, 16, number - parts * low);
  }
  return best;
}

// Eight values if the first end is larger. Codes 0 and 1 are the ends, later codes the values from the first
// end to the second.
void pack(const Bc4Block& b, bool is_signed, uint8_t* block) {
  const bool eight = b.values == Values::kEight;
  const int bottom = is_signed ? -127 : 0;
  block[0] = static_cast<uint8_t>((eight ? b.high : b.low) + bottom);
  block[1] = static_cast<uint8_t>((eight ? b.low : b.high) + bottom);
  uint64_t codes = 0;
  const int last = eight ? 7 : 5;
  for (int i = 0; i < 16; ++i) {
    const int k = eight ? 7 - b.place[i] : b.place[i];
    const int code = k == 0 ? 0 : k == last ? 1 : k < last ? k + 1 : k;
    codes |= static_cast<uint64_t>(code) << (3 * i);
  }
  for (int i = 0; i < 6; ++i) block[2 + i] = static_cast<uint8_t>(codes >> (8 * i));
}

}  // namespace

void encode_channel(const BlockTexels& texels, int channel, bool is_signed, BlockEffort effort,
                    uint8_t* block) {
  const Channel c = channel_of(texels, channel, is_signed);
  float value;
  pack(is_solid(c, value) ? solid(c, value) : search(c, effort), is_signed, block);
}

void decode_channel(const uint8_t* block, bool is_signed, int channel, BlockTexels& texels) {
  int end[2];
  for (int e = 0; e < 2; ++e) end[e] = is_signed ? static_cast<int8_t>(block[e]) : block[e];
  const int parts = end[0] > end[1] ? 7 : 5, one = is_signed ? 127 : 255;
  for (int& e : end) e = std::max(e, -127);
  float value[8];
  for (int k = 0; k <= parts; ++k) {
    const int code = k == 0 ? 0 : k == parts ? 1 : k + 1;
    value[code] = static_cast<float>((parts - k) * end[0] + k * end[1]) / static_cast<float>(parts * one);
  }
  if (parts == 5) value[6] = is_signed ? -1.0f : 0.0f, value[7] = 1.0f;
  uint64_t codes = 0;
  for (int i = 0; i < 6; ++i) codes |= uint64_t{block[2 + i]} << (8 * i);
  for (int i = 0; i < 16; ++i) texels.rgba[i][channel] = value[codes >> (3 * i) & 7];
}

}  // namespace kiln
