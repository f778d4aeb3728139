// How near bases come to skies: radiance, irradiance and reflections of what they store against quadrature.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "common/math/vec.h"

namespace kiln::test {

// Radiance by unit direction, z up; of no unit.
struct Sky {
  const char* name;
  float (*radiance)(const Vec3& direction);
};
std::span<const Sky> skies();

// Rms over the upper hemisphere, divided by the sky's mean radiance there. NaN: the basis does not say it.
struct SkyErrors {
  std::string basis;
  size_t numbers;  // a texel, of three colours
  double radiance = std::numeric_limits<double>::quiet_NaN();
  double lambert = std::numeric_limits<double>::quiet_NaN();  // E / pi, by the evaluation of engines
  double rough = std::numeric_limits<double>::quiet_NaN();    // GGX of alpha 0.4 with normal = eye = mirror
  double smooth = std::numeric_limits<double>::quiet_NaN();   // GGX of alpha 0.1
};
// SH L1, L2 and L4, the H-basis, AD9, AD12, SG9 and SG12 with the sky on the whole sphere, each projected
// (least squares over the sphere).
std::vector<SkyErrors> sky_errors(const Sky& sky, int directions, int normals);

// AD9 is nearer to Lambert than SG9, and to GGX of alpha 0.4 but under the street, where facades of windows
// suit the sharper lobes; AD12 is as near to Lambert as SH L2, to an eighth. Prints what is not so.
bool keeps_order(const Sky& sky, std::span<const SkyErrors> errors);

// A white surface of normal z under the sky's upper half, whatever the eye sees of it: what engines evaluate
// against quadrature, in the same unit. AD9, AD12, SG9, SG12 and the lamp of SH L1.
struct ReflectionErrors {
  std::string basis;
  double rough, smooth;  // GGX of alpha 0.4 and 0.1
};
std::vector<ReflectionErrors> reflection_errors(const Sky& sky, int directions, int views);

}  // namespace kiln::test
