// Fits the end points of one subset of a BC7 block.
#pragma once

#include "coordinator/output/blocks/lanes.h"

namespace kiln {

enum class Bc7P : uint8_t { kNone, kShared, kUnique, kOnes };  // kOnes: both 1, so that alpha can be 255

struct Bc7Line {
  int first, channels;  // 1, 3 or 4 channels from the first one
  int bits[4];          // of an end point, by channel from `first`, without p
  Bc7P p;
  int index_bits;
};

struct Bc7Fit {
  float error = 0;
  uint8_t ends[2][4] = {}, p[2] = {};
  uint8_t index[16] = {};
};

// `weight`: 0 outside the subset. Runs rounds of least squares, then up to `moves` rounds that try every end
// point one step away and every other p while the error falls.
Bc7Fit fit_bc7(const BlockLanes& lanes, const float* weight, const Bc7Line& line, int rounds, int moves);

}  // namespace kiln
