// End points of a set of texels: by their spread, by principal axis, by least squares for given levels; and
// which of 32 partitions promise most. All in the space of Target::ends.
#pragma once

#include <array>

#include "coordinator/output/blocks/bc6h_levels.h"

namespace kiln::bc6h {

struct Line {
  float a[3], b[3];
};

// Texels outside the mask or without weight do not count; without any that does the line is 0.
Line box_diagonal(const Target& target, const Mask& mask);
Line principal_line(const Target& target, const Mask& mask);

// The line for which levels `index` (of `count`: 8 or 16) have the least squared error. Channels without an
// answer (the texels are all on one level, or without weight) stay as they are.
void least_squares(const Target& target, const Mask& mask, const uint8_t (&index)[16], int count, Line& line);

// All partitions, the most promising first: by what is off the regions' principal axes and by what 8 levels
// leave along them.
std::array<uint8_t, kPartitions> ranked_partitions(const Target& target);

}  // namespace kiln::bc6h
