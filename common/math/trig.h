// Elementary functions from plain arithmetic, so that their last bits do not depend on the libm of a
// machine. Each states its error, which common/math tests measure.
#pragma once

#include <bit>
#include <cstdint>

#include "common/math/vec.h"

namespace kiln {

// (sin 2 pi t, cos 2 pi t) for t in [-1, 2]; absolute error below 2e-7.
struct SinCos {
  float sin, cos;
};
inline SinCos sincos_turns(float t) {
  // Reduce to the nearest eighth pair: t = k/4 + r with |r| <= 1/8, then Taylor polynomials in double.
  // No branch on the quadrant, which is unpredictable, and no floor(), which is a library call without SSE
  // 4.1.
  const int k = static_cast<int>(4.0f * t + 8.5f) - 8;
  const double a = (t - 0.25 * k) * 6.283185307179586476925;
  const double a2 = a * a;
  const double s = a * (1 + a2 * (-1.0 / 6 + a2 * (1.0 / 120 + a2 * (-1.0 / 5040 + a2 / 362880))));
  const double c = 1 + a2 * (-0.5 + a2 * (1.0 / 24 + a2 * (-1.0 / 720 + a2 / 40320)));
  const uint32_t sine = std::bit_cast<uint32_t>(static_cast<float>(s));
  const uint32_t cosine = std::bit_cast<uint32_t>(static_cast<float>(c));
  const auto quadrant = static_cast<uint32_t>(k);
  const uint32_t swap = (sine ^ cosine) & (0u - (quadrant & 1));
  const uint32_t sign_sin = (quadrant & 2) << 30, sign_cos = ((quadrant + 1) & 2) << 30;
  return {std::bit_cast<float>((sine ^ swap) ^ sign_sin), std::bit_cast<float>((cosine ^ swap) ^ sign_cos)};
}

// atan2(y, x) / (2 pi) in [-1/2, 1/2]; absolute error below 1e-7 turns. (0, 0) gives 0.
inline float atan2_turns(float y, float x) {
  const double ax = std::abs(x), ay = std::abs(y);
  const double hi = std::max(ax, ay), lo = std::min(ax, ay);
  if (hi == 0) return 0.0f;
  // atan(r) on [0, 1]: halve the range with atan(r) = pi/8 + atan((r - q)/(1 + r q)), q = tan(pi/8).
  const double r = lo / hi;
  const double q = 0.41421356237309504880;
  const double u = (r - q) / (1 + r * q), u2 = u * u;
  const double p =
      u *
      (1 + u2 * (-1.0 / 3 + u2 * (1.0 / 5 + u2 * (-1.0 / 7 + u2 * (1.0 / 9 + u2 * (-1.0 / 11 + u2 / 13))))));
  double turns = 0.0625 + p * 0.15915494309189533577;
  if (ay > ax) turns = 0.25 - turns;
  if (x < 0) turns = 0.5 - turns;
  return static_cast<float>(y < 0 ? -turns : turns);
}

// e^x, rounded to float; relative error below 1e-7. Below -87 it is 0, above 88 the largest float.
inline float exponential(float x) {
  if (!(x > -87.0f)) return 0.0f;
  if (x > 88.0f) return 0x1.fffffep127f;
  const double n =
      static_cast<double>(static_cast<int>(static_cast<double>(x) * 1.4426950408889634 + 1000.5) - 1000);
  const double r = static_cast<double>(x) - n * 0.69314718055994530942;  // |r| <= ln 2 / 2
  double p = 1.0 / 40320;
  for (const double k : {5040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0, 1.0}) p = p * r + 1.0 / k;
  return static_cast<float>(
      p * std::bit_cast<double>(static_cast<uint64_t>(static_cast<int64_t>(n) + 1023) << 52));
}

// log2 x of a positive normal number; absolute error below 1e-12 (1 + |log2 x|).
inline double logarithm2(double x) {
  // x = 2^n m with m in [1/sqrt 2, sqrt 2): log m = 2 artanh((m - 1)/(m + 1)).
  const uint64_t bits = std::bit_cast<uint64_t>(x);
  int64_t n = static_cast<int64_t>(bits >> 52) - 1023;
  double m = std::bit_cast<double>((bits & 0xfffffffffffffull) | 0x3ff0000000000000ull);
  if (m > 1.41421356237309504880) {
    m *= 0.5;
    ++n;
  }
  const double u = (m - 1) / (m + 1), u2 = u * u;  // |u| <= 0.1716
  double series = 1.0 / 17;
  for (const double k : {15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0}) series = series * u2 + 1.0 / k;
  return static_cast<double>(n) + 2.88539008177792681472 * u * series;  // 2 / ln 2
}

// x^y for x in [0, 1] and y > 0; relative error below 2e-7 + 6e-8 |y ln x|. 0 where it is below e^-87.
inline float power(float x, float y) {
  if (!(x > 0)) return 0.0f;
  return exponential(static_cast<float>(static_cast<double>(y) * logarithm2(x) * 0.69314718055994530942));
}

}  // namespace kiln
