// End points of a set of texels: by extent, by principal axis, by least squares for given levels; and a
// ranking of the 32 partitions. All in the space of Target::ends.
#pragma once

#include <array>

#include "coordinator/output/blocks/bc6h_levels.h"

namespace kiln::bc6h {

struct Line {
  float a[3], b[3];
};

// Texels outside the mask or without weight do not count; if none counts the line is 0.
Line box_diagonal(const Target& target, const Mask& mask);
Line principal_line(const Target& target, const Mask& mask);

// The line with the least squared error for the levels `index` (of `count`: 8 or 16). Leaves undetermined
// channels (all texels on one level, or without weight) unchanged.
void least_squares(const Target& target, const Mask& mask, const uint8_t (&index)[16], int count, Line& line);

// All partitions, best first, by the estimated error: the variance off the regions' principal axes plus that
// of 8 levels along them.
std::array<uint8_t, kPartitions> ranked_partitions(const Target& target);

}  // namespace kiln::bc6h
