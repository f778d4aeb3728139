// Charts of made-up levels, as masks of their bilinear footprints.
#pragma once

#include <string>

#include "common/pack/mask_set.h"

namespace kiln::test {

// Longest extents lie between `least` and `most` texels with P(extent > e) = (least / e)^fall: small `fall`
// is a heavy tail. `slivers` is the share of charts that are 8 to 40 times as long as wide, at any angle; the
// others are rectangles, L-shapes, convex polygons, triangles and discs, up to 3 times as long as wide, a
// third of them at any angle.
struct Mix {
  std::string name;
  double least, most, fall, slivers;
};

// Tiny, medium, large, slivers, everything.
const std::vector<Mix>& mixes();
// As the published level: 263,000 such charts have about ten million texels (O'Donnell 2018, Naboo).
Mix published_level();

MaskSet make_level(const Mix& mix, uint32_t count, uint64_t seed);

}  // namespace kiln::test
