// The signed relative error of a bake, to look at.
#pragma once

#include "coordinator/measure/compare/error_map.h"
#include "coordinator/picture/picture.h"

namespace kiln {

// Red: brighter than the reference, blue: darker, white: equal, grey: not measured. The colours are full at
// the 99th percentile of the size, rounded up to 1, 2 or 5 times a power of ten; the legend below names it.
// Pages stand below each other; small maps are shown with large texels. `relative`: as relative_differences
// gives it.
Picture difference_picture(const ErrorMap& layout, const std::vector<double>& relative);

// The smallest of 1, 2 and 5 times a power of ten that is not below v; v > 0.
double round_up_125(double v);

}  // namespace kiln
