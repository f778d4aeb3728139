// Trigonometry in double for the setup of samplers, where a float's angle is too coarse. Plain arithmetic,
// for the reason that trig.h gives.
#pragma once

#include <algorithm>
#include <cmath>

namespace kiln {

// (sin a, cos a) for |a| <= 4 pi; absolute error below 1e-15.
struct SinCosDouble {
  double sin, cos;
};
inline SinCosDouble sincos_radians(double a) {
  constexpr double kQuarter = 1.57079632679489655800, kQuarterLow = 6.12323399573676603587e-17;
  const int k = static_cast<int>(a / kQuarter + (a < 0 ? -0.5 : 0.5));
  const double r = (a - k * kQuarter) - k * kQuarterLow;  // |r| <= pi/4
  const double r2 = r * r;
  double s = 0, c = 0;  // Taylor series: the first terms left out are below 1e-18
  for (int n = 8; n > 0; --n) s = -r2 / (2 * n * (2 * n + 1)) * (1 + s);
  for (int n = 8; n > 0; --n) c = -r2 / (2 * n * (2 * n - 1)) * (1 + c);
  s = r * (1 + s), c = 1 + c;
  switch (k & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

// atan(y / x) in radians for x >= 0, in [-pi/2, pi/2]; absolute error below 5e-16, relative error below
// 1e-15. (0, 0) gives 0.
inline double arctangent(double y, double x) {
  const double ay = std::abs(y), hi = std::max(ay, x), lo = std::min(ay, x);
  if (!(hi > 0)) return 0;
  // atan(r) = atan(k/8) + atan((r - k/8) / (1 + r k/8)), of which the second argument is at most 1/16.
  constexpr double kOfEighths[] = {0.0,
                                   0.12435499454676143503,
                                   0.24497866312686415417,
                                   0.35877067027057222040,
                                   0.46364760900080611621,
                                   0.55859931534356243597,
                                   0.64350110879328438680,
                                   0.71882999962162450542,
                                   0.78539816339744830962};
  const double ratio = lo / hi;
  const int k = static_cast<int>(ratio * 8 + 0.5);
  const double u = (ratio - k * 0.125) / (1 + ratio * (k * 0.125)), u2 = u * u;
  double series = 0;  // the first term left out is u^17 / 17, below 1e-21
  for (int n = 15; n > 1; n -= 2) series = u2 * (1.0 / n - series);
  double angle = kOfEighths[k] + u * (1 - series);
  if (ay > x) angle = 1.57079632679489661923 - angle;
  return y < 0 ? -angle : angle;
}

}  // namespace kiln
