// Which partitions of a block promise a small error.
#pragma once

#include "coordinator/output/blocks/lanes.h"

namespace kiln {

// By partition: what is left of the texels' squares behind the best line through each subset, which no choice
// of end points undercuts by more than rounding to bytes, and the same with the steps of 2^index_bits places
// on it.
struct Bc7PartitionBound {
  alignas(64) float least[64];
  alignas(64) float expected[64];
};

// `channels`: 3 or 4; `subsets`: 2 or 3.
Bc7PartitionBound bc7_partition_bound(const BlockLanes& lanes, int channels, int subsets, int index_bits);

// The next best partition of the first `count` by what is expected; marks it as taken.
int take_best(Bc7PartitionBound& promise, int count);

}  // namespace kiln
