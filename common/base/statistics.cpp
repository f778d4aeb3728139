#include "common/base/statistics.h"

#include <cmath>

#include "common/base/check.h"

namespace kiln {

double normal_interval(double confidence) {
  KILN_CHECK(confidence > 0 && confidence < 1);
  // Bisection on erf is slow (60 steps) but certain; this runs once per bake.
  double low = 0, high = 40;
  for (int i = 0; i < 200 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    (std::erf(middle / std::sqrt(2.0)) < confidence ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace kiln
