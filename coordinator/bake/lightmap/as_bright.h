// Whether two texels have about as much light, as far as their samples tell.
#pragma once

#include <algorithm>

namespace kiln {

// The brighter of two has at most this many times the light of the other, within this many standard errors.
constexpr double kAlikeLight = 2, kAlikeErrors = 3;

// `square_of_error`: of either light.
inline bool is_as_bright(double a, double b, double square_of_error) {
  const double beyond = std::max(a, b) - kAlikeLight * std::min(a, b);
  return beyond <= 0 || beyond * beyond <= kAlikeErrors * kAlikeErrors * 2 * square_of_error;
}

}  // namespace kiln
