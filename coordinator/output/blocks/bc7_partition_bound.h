// Ranks the partitions of a block by a bound on their error.
#pragma once

#include "coordinator/output/blocks/lanes.h"

namespace kiln {

// By partition: the squared distance of the texels from the best line through each subset, a lower bound for
// any end points up to rounding to bytes, and the same plus the quantisation error of 2^index_bits levels on
// the line.
struct Bc7PartitionBound {
  alignas(64) float least[64];
  alignas(64) float expected[64];
};

// `channels`: 3 or 4; `subsets`: 2 or 3.
Bc7PartitionBound bc7_partition_bound(const BlockLanes& lanes, int channels, int subsets, int index_bits);

// The next best of the first `count` partitions by expected error; marks it as taken.
int take_best(Bc7PartitionBound& promise, int count);

}  // namespace kiln
