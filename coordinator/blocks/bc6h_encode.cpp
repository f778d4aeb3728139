#include <algorithm>
#include <array>

#include "coordinator/blocks/bc6h.h"
#include "coordinator/blocks/bc6h_search.h"

namespace kiln {
namespace {
using namespace bc6h;

// The candidates to go on with, the best first; of equals the one that came first.
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

// What is better by the score but not worse by the error alone: more effort never costs error.
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

template <size_t kDescents>
void search(const Target& target, int partitions, int solves, int reach, int rounds, Candidate& best) {
  Shortlist<kDescents> open;
  Candidate one = best;
  solve(target, solves, one);
  open.add(one);
  const std::array<uint8_t, 32> ranked = ranked_partitions(target);
  for (int p = 0; p < partitions; ++p) {
    const Block regions{0, ranked[p]};
    Candidate two = two_region(
        target, ranked[p],
        {principal_line(target, mask_of(regions, 0)), principal_line(target, mask_of(regions, 1))});
    solve(target, solves, two);
    open.add(two);
  }
  for (Candidate& candidate : open) {
    improve(best, candidate);
    stretch(target, reach, solves, candidate);
    improve(best, candidate);
    descend(target, rounds, candidate);
    improve(best, candidate);
  }
}

void encode(const BlockTexels& texels, const BlockChoice& choice, bool is_signed, uint8_t* block) {
  Target target;
  make_target(texels, choice.metric, is_signed, target);
  Candidate best = fast(target);
  if (choice.effort != BlockEffort::kFast) search<1>(target, 2, 2, 0, 1, best);
  if (choice.effort == BlockEffort::kBest) search<3>(target, 32, 3, 2, 16, best);
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
