// Merges charts that can be flattened together: fewer seams, fewer border texels.
#pragma once

#include <vector>

#include "common/unwrap/flatten.h"

namespace kiln {

struct MergeSettings {
  FlattenLimits limits;
  uint32_t max_faces = 12000;
  uint64_t work = 0;  // start no round once this much work was spent
};

// Works in rounds: pairs of neighbours, those that share most of their boundary first, are tried in parallel
// on `threads` threads; a pair is glued along all shared sides, or else along the longest run of them, so
// that a tube unrolls. Stops when no pair fits or the work is spent. The result does not depend on the
// threads.
void merge_charts(const Surface& surface, ChartState& state, std::vector<FlatChart>& charts,
                  const MergeSettings& settings, unsigned threads, uint64_t& work);

}  // namespace kiln
