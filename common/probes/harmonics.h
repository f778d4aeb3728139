// Light of probes in spherical harmonics: radiance, orthonormal real harmonics of degree 0 to 2, world axes,
// in the order 1, y, z, x, xy, yz, 3 z^2 - 1, xz, x^2 - y^2. This is the order and scale of three.js's
// LightProbe and of Ramamoorthi & Hanrahan 2001, whose sections 2 and 3 give the constants below.
#pragma once

#include <array>

#include "common/math/vec.h"

namespace kiln {

constexpr size_t kHarmonics = 9;
using Harmonics = std::array<Vec3, kHarmonics>;  // RGB by function
constexpr std::array<const char*, kHarmonics> kHarmonicNames{"L00",  "L1m1", "L10", "L11", "L2m2",
                                                             "L2m1", "L20",  "L21", "L22"};
constexpr std::array<uint32_t, kHarmonics> kHarmonicDegree{0, 1, 1, 1, 2, 2, 2, 2, 2};

// Of the functions of ShL2 (common/responses/sh_l2.h): which one, and how many of it make the coefficient.
struct FromMoment {
  size_t function;
  float scale;
};
constexpr std::array<FromMoment, kHarmonics> kFromMoments{{{0, 3.5449077018f},
                                                           {2, 6.1399602477f},
                                                           {3, 6.1399602477f},
                                                           {1, 6.1399602477f},
                                                           {4, 13.7293685177f},
                                                           {5, 13.7293685177f},
                                                           {6, 11.8899819288f},
                                                           {7, 13.7293685177f},
                                                           {8, 6.8646842589f}}};

inline std::array<float, kHarmonics> harmonics_at(const Vec3& d) {
  return {0.2820947918f,
          0.4886025119f * d.y,
          0.4886025119f * d.z,
          0.4886025119f * d.x,
          1.0925484306f * d.x * d.y,
          1.0925484306f * d.y * d.z,
          0.3153915653f * (3.0f * d.z * d.z - 1.0f),
          1.0925484306f * d.x * d.z,
          0.5462742153f * (d.x * d.x - d.y * d.y)};
}

// Factors of the clamped cosine by degree: E's coefficients from those of radiance.
constexpr std::array<float, 3> kCosineFactor{3.1415926536f, 2.0943951024f, 0.7853981634f};

// Irradiance of a surface with that unit normal; may be a little negative opposite to strong light.
inline Vec3 harmonic_irradiance(const Harmonics& light, const Vec3& normal) {
  const std::array<float, kHarmonics> y = harmonics_at(normal);
  Vec3 e(0.0f);
  for (size_t k = 0; k < kHarmonics; ++k) e += light[k] * (y[k] * kCosineFactor[kHarmonicDegree[k]]);
  return e;
}

// Scales the degrees by 1 / (1 + a l^2 (l + 1)^2) with the least a >= 0, up to a tenth of a percent, for
// which E is nowhere negative (Sloan 2008, Stupid Spherical Harmonics Tricks, "Windowing"). The window is the
// same for all colours.
Harmonics without_ringing(const Harmonics& light);

}  // namespace kiln
