// Tone mapping: from radiance to displayed values.
#pragma once

#include <vector>

namespace kiln {

// Narkowicz 2015, ACES filmic tone mapping curve (fit): display light in [0, 1] from exposed radiance.
float filmic(float x);

// Exposure that maps the median of the positive luminances to mid grey, but keeps the brightest twentieth
// below clipping, so that sunlit ground beside deep shade stays readable. 1 if nothing is lit.
float exposure_of(std::vector<float> luminances);

}  // namespace kiln
