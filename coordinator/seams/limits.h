// How far the two sides of its seams leave it undecided what a texel holds: no correction goes further.
#pragma once

#include "coordinator/seams/system.h"

namespace kiln {

// Of the corrections of one plane, by unknown: low <= 0 <= high.
//
// A texel may move towards the other side by `share` of the difference that all seam points that read it
// agree on: the smallest, if they have one sign; but by no more than a tenth of its light, and than light
// changes among its own chart's texels around it. Footprints that a border cuts off set one side off at all
// points, by a part of that change. Where light changes along the seam within a texel, points do not agree:
// two rows of texels that are staggered, or a texel that straddles the end of a seam, show the edge of a
// shadow a little differently, and neither is wrong. Where a side is even and the other is another, light
// does end at the seam. Beyond that it may move by `errors` stated errors (less where the points differ by
// more than noise lets them), and never further out of the range of the values that those points read on both
// sides. Filled texels are guesses: they may have any value of that range.
struct MoveLimits {
  std::vector<double> low, high;
};
MoveLimits move_limits(const Atlas& atlas, const Lightmap& map, size_t plane, const SeamUnknowns& unknowns,
                       const SeamWeights& weights);

}  // namespace kiln
