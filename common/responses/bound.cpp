#include "common/responses/bound.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace kiln {
namespace {

// Below this squares of floats vanish: what light there is has no direction.
constexpr float kMinLight = 1e-18f;
// Function 0 is at most this many times e / pi, or rounding and compression would show where most of the
// light is behind the normal.
constexpr double kMostShown = 4;

}  // namespace

void hold_exactly(const ExactAt& at, float* f) {
  KILN_CHECK(at.count >= 4);
  const double level = at.e > 0 ? double{at.e} / double{kPi} : 0;
  if (!(at.e > kMinLight)) {
    f[0] = static_cast<float>(level);
    std::fill(f + 1, f + at.count, 0.0f);
    return;
  }
  f[0] = 0;
  const double shown = double{at.irradiance(f, at.n, at.n)} / double{kPi};  // of the others at the normal
  double largest = length(Vec3(f[1], f[2], f[3]));
  for (int k = 4; k < at.count; ++k) largest = std::max(largest, std::abs(double{f[k]}));
  // function 0 = level - scale x shown >= scale x largest, less a part in 2^20 for rounding
  double scale = 1;
  if (largest + shown > 0) scale = std::min(scale, level * (1 - 0x1p-20) / (largest + shown));
  if (shown < 0) scale = std::min(scale, level * (kMostShown - 1) / -shown);
  for (int k = 1; k < at.count; ++k) f[k] = static_cast<float>(f[k] * scale);
  f[0] = static_cast<float>(level - scale * shown);
}

}  // namespace kiln
