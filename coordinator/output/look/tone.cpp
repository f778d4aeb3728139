#include "coordinator/output/look/tone.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace kiln {

float filmic(float x) {
  x = std::max(0.0f, x);
  const float y = (x * (2.51f * x + 0.03f)) / (x * (2.43f * x + 0.59f) + 0.14f);
  return std::clamp(y, 0.0f, 1.0f);
}

float exposure_of(std::vector<float> luminances) {
  std::erase_if(luminances, [](float l) { return !(l > 0) || !std::isfinite(l); });
  if (luminances.empty()) return 1.0f;
  const auto quantile = [&](double q) {
    const auto at =
        luminances.begin() + static_cast<ptrdiff_t>(q * static_cast<double>(luminances.size() - 1));
    std::nth_element(luminances.begin(), at, luminances.end());
    return *at;
  };
  const float middle = 0.22f / quantile(0.5);
  return std::clamp(1.4f / quantile(0.95), 0.25f * middle, middle);
}

}  // namespace kiln
