// Encodes compressed blocks on both sides of a seam so that they decode as equal as possible.
#pragma once

#include <span>

#include "coordinator/bake/seams/equations.h"
#include "coordinator/output/blocks/blocks.h"

namespace kiln {

// One texture's level 0 in a block format: pages stacked, and the blocks of each page.
struct SeamBlocks {
  const BlockFormat* format = nullptr;
  BlockChoice choice;
  uint32_t width = 0, page_height = 0;
  std::span<const float> target;  // 4 a texel: the desired decoded values
  std::span<const float> weight;  // by texel: for the encoder
  std::span<const float> norm;    // by texel: weight of a squared difference; 0: unused
  std::vector<Bytes>* pages = nullptr;
  std::vector<float>* decoded = nullptr;  // 4 a texel: decoded *pages; kept up to date
};

struct SeamMatch {
  uint64_t equations = 0, blocks = 0, changed = 0;
  // Root mean square and maximum of the step added by compression, relative to the light there.
  double rms_before = 0, rms_after = 0, largest_before = 0, largest_after = 0;
};

// In rounds: every block with texels of a seam is encoded again with targets that close half of the steps
// from its side, and kept if kSeamShare x steps^2 + errors^2 falls. Candidates are made in parallel, kept in
// the order of blocks.
SeamMatch match_seams(const SeamBlocks& blocks, std::span<const SeamEquation> equations);

}  // namespace kiln
