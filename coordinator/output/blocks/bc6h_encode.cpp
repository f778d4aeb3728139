#include <algorithm>
#include <array>

#include "coordinator/output/blocks/bc6h.h"
#include "coordinator/output/blocks/bc6h_search.h"

namespace kiln {
namespace {
using namespace bc6h;

// The shortlist of candidates, best first; ties keep their order.
template <size_t kSize>
class Shortlist {
 public:
  void add(const Candidate& candidate) {
    size_t at = std::min(count_, kSize - 1);
    if (count_ == kSize && !(candidate.score < list_[at].score)) return;
    for (; at > 0 && candidate.score < list_[at - 1].score; --at) list_[at] = list_[at - 1];
    list_[at] = candidate;
    count_ = std::min(count_ + 1, kSize);
  }
  Candidate* begin() { return list_.data(); }
  Candidate* end() { return list_.data() + count_; }

 private:
  std::array<Candidate, kSize> list_;
  size_t count_ = 0;
};

// Better by score and not worse by error, so that more effort never increases the error.
void improve(Candidate& candidate, const Candidate& other) {
  if (other.score < candidate.score && other.cost.error <= candidate.cost.error) candidate = other;
}

Candidate fast(const Target& target) {
  const Mask& all = mask_of(Block{kFirstOneRegion}, 0);
  Candidate best = one_region(target, box_diagonal(target, all));
  Candidate along = one_region(target, principal_line(target, all));
  solve(target, 1, along);
  improve(best, along);
  return best;
}

// The search of each effort, beyond one region by its axis.
struct Effort {
  int partitions;  // best-ranked partitions tried, with two regions
  int solves;      // rounds of least squares, of each candidate
  bool fold;       // those on the shortlist
  int reach;       // of stretch(), of the same
  int rounds;      // of descend(), of the same
};
constexpr Effort kNormal = {2, 1, false, 0, 1};
constexpr Effort kBest = {16, 1, true, 2, 4};

template <size_t kShortlist>
void search(const Target& target, const Effort& effort, Candidate& best) {
  Shortlist<kShortlist> open;
  Candidate one = best;
  solve(target, effort.solves, one);
  open.add(one);
  const std::array<uint8_t, kPartitions> ranked = ranked_partitions(target);
  for (int p = 0; p < effort.partitions; ++p) {
    const Block regions{0, ranked[p]};
    Candidate two = two_region(
        target, ranked[p],
        {principal_line(target, mask_of(regions, 0)), principal_line(target, mask_of(regions, 1))});
    solve(target, effort.solves, two);
    open.add(two);
  }
  for (Candidate& candidate : open) {
    improve(best, candidate);
    if (effort.fold) fold(target, candidate);
    stretch(target, effort.reach, effort.solves, candidate);
    improve(best, candidate);
    descend(target, effort.rounds, candidate);
    improve(best, candidate);
  }
}

void encode(const BlockTexels& texels, const BlockChoice& choice, bool is_signed, uint8_t* block) {
  Target target;
  make_target(texels, choice.metric, is_signed, target);
  Candidate best = fast(target);
  if (choice.effort != BlockEffort::kFast && best.cost.error > 0) search<1>(target, kNormal, best);
  if (choice.effort == BlockEffort::kBest && best.cost.error > 0) search<2>(target, kBest, best);
  settle_anchors(best.block);
  pack(best.block, block);
}

}  // namespace

void encode_bc6h_ufloat(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block) {
  encode(texels, choice, false, block);
}

void encode_bc6h_sfloat(const BlockTexels& texels, const BlockChoice& choice, uint8_t* block) {
  encode(texels, choice, true, block);
}

}  // namespace kiln
