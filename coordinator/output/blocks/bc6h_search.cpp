#include "coordinator/output/blocks/bc6h_search.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace kiln::bc6h {
namespace {

// From the finest end points to the coarsest. The last mode of each fits any.
constexpr int kOneRegion[] = {13, 12, 11, 10};
constexpr int kTwoRegions[] = {2, 3, 4, 0, 5, 6, 7, 8, 1, 9};

// The worst texel counts as this many additional texels with its error.
constexpr float kWorst = 4.0f;

// Solving does not recover from a start this many times worse.
constexpr float kHopeless = 2.0f;

// Levels that fold() uses for a block's whole range.
constexpr int kFolded = 6;

void sum_up(const Cost (&regions)[2], Candidate& candidate) {
  candidate.cost = {regions[0].error + regions[1].error, std::max(regions[0].worst, regions[1].worst)};
  candidate.score = candidate.cost.error + kWorst * candidate.cost.worst;
}

bool fits_settled(const Block& block, bool is_signed) {
  return fits(block, settled_base(block), is_signed);
}

// Rounds `value`, an end point's channel, to the nearest representable in `bits`.
int quantised(float value, int bits, bool is_signed) {
  const float size = is_signed ? std::fabs(value) : std::max(value, 0.0f);
  const int top = (1 << (is_signed ? bits - 1 : bits)) - 1;
  const float cell = size * std::bit_cast<float>((127 + bits - 16) << 23);
  int q;
  // A code decodes to the middle of its cell, except that the first is 0 and the last the maximum.
  if (bits == 16)
    q = static_cast<int>(std::min(cell + 0.5f, static_cast<float>(top)));
  else if (cell < 0.75f)
    q = 0;
  else if (cell > static_cast<float>(top) + 0.25f)
    q = top;
  else
    q = std::clamp(static_cast<int>(cell), 1, top - 1);
  return is_signed && value < 0 ? -q : q;
}

// Differences of a channel's end points to the first.
float span_of(const Line (&lines)[2], int c, bool two) {
  const float base = lines[0].a[c];
  const float first = std::fabs(lines[0].b[c] - base);
  return two ? std::max({first, std::fabs(lines[1].a[c] - base), std::fabs(lines[1].b[c] - base)}) : first;
}

// Before quantisation, which may shorten a span by a cell. (fits() handles differences that wrap.)
bool may_fit(const Mode& mode, const float (&span)[3]) {
  if (!mode.transformed) return true;
  const auto cell = static_cast<float>(1 << (16 - mode.bits));
  for (int c = 0; c < 3; ++c)
    if (span[c] > cell * static_cast<float>((1 << (mode.delta[c] - 1)) + 1)) return false;
  return true;
}

template <size_t kCount>
Candidate finest(const Target& target, const int (&modes)[kCount], int partition, const Line (&lines)[2]) {
  Candidate candidate;
  Block& block = candidate.block;
  block.partition = partition;
  float span[3];
  for (int c = 0; c < 3; ++c) span[c] = span_of(lines, c, two_regions(modes[0]));
  for (const int mode : modes) {
    if (!may_fit(kModeTable[mode], span)) continue;
    block.mode = mode;
    const int bits = kModeTable[mode].bits;
    for (int region = 0; region < (two_regions(mode) ? 2 : 1); ++region)
      for (int c = 0; c < 3; ++c) {
        block.ends[2 * region][c] = quantised(lines[region].a[c], bits, target.is_signed);
        block.ends[2 * region + 1][c] = quantised(lines[region].b[c], bits, target.is_signed);
      }
    const bool room = fits(block, 0, target.is_signed) || fits(block, 1, target.is_signed);
    if (room && judge(target, candidate)) return candidate;
  }
  return candidate;
}

// One end point's channel, or both of a region's.
struct Move {
  int region, channel, first, second;  // steps of the two ends
};

void lines_of(const Block& block, bool is_signed, Line (&lines)[2]) {
  const int bits = kModeTable[block.mode].bits;
  for (int region = 0; region < 2; ++region)
    for (int c = 0; c < 3; ++c) {
      lines[region].a[c] = static_cast<float>(spread(block.ends[2 * region][c], bits, is_signed));
      lines[region].b[c] = static_cast<float>(spread(block.ends[2 * region + 1][c], bits, is_signed));
    }
}

class Descent {
 public:
  Descent(const Target& target, Candidate& candidate) : target_(target), at_(candidate) {
    for (int region = 0; region < regions(); ++region)
      costs_[region] = find_indices(target, region, at_.block);
    sum_up(costs_, at_);
  }

  int regions() const { return two_regions(at_.block.mode) ? 2 : 1; }

  bool gains(const Move& move) {
    Candidate to = at_;
    int* const first = &to.block.ends[2 * move.region][move.channel];
    int* const second = &to.block.ends[2 * move.region + 1][move.channel];
    *first += move.first;
    *second += move.second;
    if (!in_range(*first) || !in_range(*second)) return false;
    Cost costs[2] = {costs_[0], costs_[1]};
    costs[move.region] = find_indices(target_, move.region, to.block);
    sum_up(costs, to);
    if (!(to.score < at_.score) || !fits_settled(to.block, target_.is_signed)) return false;
    at_ = to;
    costs_[move.region] = costs[move.region];
    return true;
  }

 private:
  bool in_range(int end) const {
    const int bits = kModeTable[at_.block.mode].bits;
    const int top = (1 << (target_.is_signed ? bits - 1 : bits)) - 1;
    return end <= top && end >= (target_.is_signed ? -top : 0);
  }

  const Target& target_;
  Candidate& at_;
  Cost costs_[2];
};

}  // namespace

bool judge(const Target& target, Candidate& candidate) {
  Cost costs[2];
  for (int region = 0; region < (two_regions(candidate.block.mode) ? 2 : 1); ++region)
    costs[region] = find_indices(target, region, candidate.block);
  sum_up(costs, candidate);
  return fits_settled(candidate.block, target.is_signed);
}

Candidate one_region(const Target& target, const Line& line) {
  return finest(target, kOneRegion, 0, {line, Line{}});
}

Candidate two_region(const Target& target, int partition, const Line (&lines)[2]) {
  return finest(target, kTwoRegions, partition, lines);
}

void solve(const Target& target, int rounds, Candidate& candidate) {
  for (int round = 0; round < rounds; ++round) {
    Line lines[2];
    lines_of(candidate.block, target.is_signed, lines);
    const bool two = two_regions(candidate.block.mode);
    for (int region = 0; region < (two ? 2 : 1); ++region)
      least_squares(target, mask_of(candidate.block, region), candidate.block.index, two ? 8 : 16,
                    lines[region]);
    const Candidate next =
        two ? two_region(target, candidate.block.partition, lines) : one_region(target, lines[0]);
    if (!(next.score < candidate.score)) return;
    candidate = next;
  }
}

void stretch(const Target& target, int reach, int solves, Candidate& candidate) {
  const bool two = two_regions(candidate.block.mode);
  const float half_level = 0.5f / (two ? 7 : 15);
  for (int region = 0; region < (two ? 2 : 1); ++region) {
    Line from[2];
    lines_of(candidate.block, target.is_signed, from);
    for (int first = -reach; first <= reach; ++first)
      for (int second = -reach; second <= reach; ++second) {
        if (first == 0 && second == 0) continue;
        Line lines[2] = {from[0], from[1]};
        for (int c = 0; c < 3; ++c) {
          const float step = half_level * (from[region].b[c] - from[region].a[c]);
          lines[region].a[c] -= static_cast<float>(first) * step;
          lines[region].b[c] += static_cast<float>(second) * step;
        }
        Candidate other =
            two ? two_region(target, candidate.block.partition, lines) : one_region(target, lines[0]);
        if (other.score > kHopeless * candidate.score) continue;
        solve(target, solves, other);
        if (other.score < candidate.score) candidate = other;
      }
  }
}

void fold(const Target& target, Candidate& candidate) {
  if (two_regions(candidate.block.mode)) return;
  Line from[2];
  lines_of(candidate.block, target.is_signed, from);
  for (int levels = 1; levels <= kFolded; ++levels)
    for (int first = 0; first + levels < 16; ++first) {
      const float start = kWeights16[first] * (1.0f / 64);
      const float over = 64.0f / static_cast<float>(kWeights16[first + levels] - kWeights16[first]);
      Line line;
      for (int c = 0; c < 3; ++c) {
        const float whole = over * (from[0].b[c] - from[0].a[c]);
        line.a[c] = from[0].a[c] - start * whole;
        line.b[c] = line.a[c] + whole;
      }
      Candidate other = one_region(target, line);
      if (other.score > kHopeless * candidate.score) continue;
      solve(target, 1, other);
      if (other.score < candidate.score) candidate = other;
    }
}

void descend(const Target& target, int rounds, Candidate& candidate) {
  constexpr int kSteps[][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}};
  Descent descent(target, candidate);
  for (int round = 0; round < rounds; ++round) {
    bool any = false;
    for (int region = 0; region < descent.regions(); ++region)
      for (int c = 0; c < 3; ++c)
        for (const auto& step : kSteps)
          while (descent.gains({region, c, step[0], step[1]})) any = true;
    if (!any) return;
  }
}

}  // namespace kiln::bc6h
