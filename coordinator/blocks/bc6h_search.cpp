#include "coordinator/blocks/bc6h_search.h"

#include <algorithm>

namespace kiln::bc6h {
namespace {

// From the finest end points to the coarsest. The last of each has room for any.
constexpr int kOneRegion[] = {13, 12, 11, 10};
constexpr int kTwoRegions[] = {2, 3, 4, 0, 5, 6, 7, 8, 1, 9};

// The worst texel counts as so many texels with its error more.
constexpr float kWorst = 4.0f;

void sum_up(const Cost (&regions)[2], Candidate& candidate) {
  candidate.cost = {regions[0].error + regions[1].error, std::max(regions[0].worst, regions[1].worst)};
  candidate.score = candidate.cost.error + kWorst * candidate.cost.worst;
}

void take_indices(const Nearest& nearest, uint32_t texels, Block& block) {
  for (int i = 0; i < 16; ++i)
    if (texels >> i & 1) block.index[i] = static_cast<uint8_t>(nearest.index[i]);
}

bool fits_settled(Block block, bool is_signed) {
  settle_anchors(block);
  return fits(block, is_signed);
}

Cost judge_region(const Target& target, int region, Block& block) {
  const uint32_t texels = texels_of(block, region);
  Nearest nearest;
  find_nearest(target, block.mode, block.ends[2 * region], block.ends[2 * region + 1], nearest);
  take_indices(nearest, texels, block);
  return cost_of(target, nearest, texels);
}

template <size_t kCount>
Candidate finest(const Target& target, const int (&modes)[kCount], int partition, const Line (&lines)[2]) {
  Candidate candidate;
  Block& block = candidate.block;
  block.partition = partition;
  for (const int mode : modes) {
    block.mode = mode;
    const int bits = kModeTable[mode].bits;
    for (int region = 0; region < (two_regions(mode) ? 2 : 1); ++region)
      for (int c = 0; c < 3; ++c) {
        block.ends[2 * region][c] = quantised(lines[region].a[c], bits, target.is_signed);
        block.ends[2 * region + 1][c] = quantised(lines[region].b[c], bits, target.is_signed);
      }
    if (fits(block, target.is_signed) && judge(target, candidate)) return candidate;
  }
  return candidate;
}

// One end point's channel, or both of a region's.
struct Move {
  int region, channel, first, second;  // steps of the two ends
};

class Descent {
 public:
  Descent(const Target& target, Candidate& candidate) : target_(target), at_(candidate) {
    for (int region = 0; region < regions(); ++region)
      costs_[region] = judge_region(target, region, at_.block);
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
    costs[move.region] = judge_region(target_, move.region, to.block);
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

uint32_t texels_of(const Block& block, int region) {
  if (!two_regions(block.mode)) return region == 0 ? 0xFFFF : 0;
  const uint32_t second = kPartitionTable[block.partition];
  return region == 0 ? ~second & 0xFFFF : second;
}

bool judge(const Target& target, Candidate& candidate) {
  Cost costs[2];
  for (int region = 0; region < (two_regions(candidate.block.mode) ? 2 : 1); ++region)
    costs[region] = judge_region(target, region, candidate.block);
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
    const Block& block = candidate.block;
    const bool two = two_regions(block.mode);
    Line lines[2];
    for (int region = 0; region < (two ? 2 : 1); ++region) {
      for (int c = 0; c < 3; ++c) {
        const int bits = kModeTable[block.mode].bits;
        lines[region].a[c] = static_cast<float>(spread(block.ends[2 * region][c], bits, target.is_signed));
        lines[region].b[c] =
            static_cast<float>(spread(block.ends[2 * region + 1][c], bits, target.is_signed));
      }
      least_squares(target, texels_of(block, region), block.index, two ? 8 : 16, lines[region]);
    }
    const Candidate next = two ? two_region(target, block.partition, lines) : one_region(target, lines[0]);
    if (!(next.score < candidate.score)) return;
    candidate = next;
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
