// Charts that flatten together become one: fewer seams, fewer border texels.
#pragma once

#include <vector>

#include "common/unwrap/flatten.h"

namespace kiln {

struct MergeSettings {
  FlattenLimits limits;
  uint32_t max_faces = 12000;
  uint64_t work = 0;  // stop before a round once this much was spent
};

// Rounds: pairs of neighbours, those first that share most of their boundary, are tried at once on `threads`
// threads; a pair is glued along all the sides it shares, or else along the longest run of them, so that a
// tube unrolls. Ends when no pair fits, or by the work. The result does not depend on the threads.
void merge_charts(const Surface& surface, ChartState& state, std::vector<FlatChart>& charts,
                  const MergeSettings& settings, unsigned threads, uint64_t& work);

}  // namespace kiln
