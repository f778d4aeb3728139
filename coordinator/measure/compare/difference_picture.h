// A picture of the signed relative error of a bake.
#pragma once

#include "coordinator/measure/compare/error_map.h"
#include "coordinator/picture/picture.h"

namespace kiln {

// Red: brighter than the reference, blue: darker, white: equal, grey: not measured. Colours
// saturate at the 99th percentile of the magnitude, rounded up to 1, 2 or 5 times a power of ten,
// which the legend names. Pages are stacked; small maps are enlarged. `relative`: from
// relative_differences.
Picture difference_picture(const ErrorMap& layout, const std::vector<double>& relative);

// The smallest of 1, 2 and 5 times a power of ten that is at least v; v > 0.
double round_up_125(double v);

}  // namespace kiln
