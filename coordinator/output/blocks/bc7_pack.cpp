#include <algorithm>
#include <utility>

#include "coordinator/output/blocks/bc7_candidate.h"
#include "coordinator/output/blocks/bc7_tables.h"

namespace kiln {
namespace {

class BitWriter {
 public:
  explicit BitWriter(uint8_t* bytes) : bytes_(bytes) { std::fill_n(bytes, 16, uint8_t{0}); }
  void put(int value, int bits) {
    for (int i = 0; i < bits; ++i, ++at_)
      bytes_[at_ / 8] = static_cast<uint8_t>(bytes_[at_ / 8] | (value >> i & 1) << (at_ % 8));
  }

 private:
  uint8_t* bytes_;
  int at_ = 0;
};

// Channels [first, last) of a subset, and the indices that interpolate them.
void turn(Bc7Candidate& k, int subset, int first, int last, const Bc7Partition& partition, uint8_t* index,
          int index_bits) {
  const int top = (1 << index_bits) - 1;
  if (index[partition.anchor[static_cast<size_t>(subset)]] <= top / 2) return;
  for (int c = first; c < last; ++c) std::swap(k.ends[subset][0][c], k.ends[subset][1][c]);
  for (int i = 0; i < 16; ++i)
    if (partition.subset[static_cast<size_t>(i)] == subset) index[i] = static_cast<uint8_t>(top - index[i]);
}

}  // namespace

void pack_bc7(Bc7Candidate k, uint8_t* block) {
  const Bc7Mode& mode = kBc7Modes[k.mode];
  const Bc7Partition& partition = bc7_partitions(mode.subsets)[k.partition];
  const int colour_bits = k.selector ? mode.index2_bits : mode.index_bits;
  const int alpha_bits = k.selector ? mode.index_bits : mode.index2_bits;
  for (int s = 0; s < mode.subsets; ++s) {
    const int anchor = k.index[partition.anchor[static_cast<size_t>(s)]];
    if (anchor > ((1 << colour_bits) - 1) / 2) std::swap(k.p[s][0], k.p[s][1]);
    turn(k, s, 0, mode.index2_bits ? 3 : 4, partition, k.index, colour_bits);
  }
  if (mode.index2_bits) turn(k, 0, 3, 4, partition, k.index2, alpha_bits);

  BitWriter out(block);
  out.put(1 << k.mode, k.mode + 1);
  out.put(k.partition, mode.partition_bits);
  out.put(k.rotation, mode.rotation_bits);
  out.put(k.selector, mode.selector_bits);
  for (int c = 0; c < 4; ++c)
    for (int s = 0; s < mode.subsets; ++s)
      for (int e = 0; e < 2; ++e) out.put(k.ends[s][e][c], c < 3 ? mode.colour_bits : mode.alpha_bits);
  for (int s = 0; s < mode.subsets; ++s)
    for (int e = 0; e < (mode.unique_p ? 2 : mode.shared_p); ++e) out.put(k.p[s][e], 1);
  const uint8_t* first = k.selector ? k.index2 : k.index;
  const uint8_t* second = k.selector ? k.index : k.index2;
  for (int i = 0; i < 16; ++i)
    out.put(first[i], mode.index_bits - (i == partition.anchor[partition.subset[static_cast<size_t>(i)]]));
  if (mode.index2_bits)
    for (int i = 0; i < 16; ++i) out.put(second[i], mode.index2_bits - (i == 0));
}

}  // namespace kiln
