// A perceptually uniform colour ramp for maps.
#pragma once

#include "common/math/vec.h"

namespace kiln {

// Five stops from dark blue (0) to yellow (1), interpolated; components 0 to 255.
inline Vec3 ramp(float t) {
  const Vec3 stops[] = {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}};
  t = std::clamp(t, 0.0f, 1.0f) * 4.0f;
  const int i = std::min(3, static_cast<int>(t));
  return stops[i] + (stops[i + 1] - stops[i]) * (t - static_cast<float>(i));
}

}  // namespace kiln
