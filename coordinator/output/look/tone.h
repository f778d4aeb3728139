// From radiance to a displayed picture.
#pragma once

#include <vector>

namespace kiln {

// Narkowicz 2015, ACES filmic tone mapping curve (fit): display light in [0, 1] from exposed radiance.
float filmic(float x);

// Scale that brings the median of the positive luminances to a mid grey, but leaves the brightest twentieth
// room before the curve clips: sunlit ground beside deep shade stays readable. 1 where nothing is lit.
float exposure_of(std::vector<float> luminances);

}  // namespace kiln
