// How renderers evaluate the stored planes of sh_l1, as a reference; docs/shaders/kiln_lightmap.glsl is the
// same in GLSL. Arguments follow the convention of ShL1; normals and directions are unit vectors in world
// axes.
#pragma once

#include "common/math/vec.h"

namespace kiln {

// Non-linear reconstruction of E(n) from one channel (Hazel 2017, Reconstructing diffuse lighting from
// spherical harmonic data):
//   E/pi = L0 (k + (1 - k)(p + 1) q^p),  a = |L1|/L0, q = (1 + n.L1/|L1|)/2, p = 1 + 2a, k = (1 - a)/(1 + a)
// Never negative, and the mean over the sphere of E/pi is L0, since q is uniform in [0, 1] over the
// sphere and the integral of (p + 1) q^p is 1. For a = 1 all light comes from one direction: E/pi =
// 4 L0 q^3, where the truth is 4 L0 max(0, n.d). Unit: that of E. Limits: L0 <= 0 gives 0, L1 = 0
// gives pi L0; a is clamped to 1 for |L1| > L0, which only filters and encoders produce.
float sh_l1_irradiance_nonlinear(float l0, const Vec3& l1, const Vec3& n);

// RGB planes of a texel; l1[k] belongs to the k-th axis.
struct ShL1Texel {
  Vec3 l0;
  Vec3 l1[3];
};

// Linear reconstruction per channel, clamped at 0 (sh_l1_irradiance is not).
Vec3 irradiance_linear(const ShL1Texel& texel, const Vec3& n);
Vec3 irradiance_nonlinear(const ShL1Texel& texel, const Vec3& n);

// The dominant direction over the three channels, and how focused the light is: |L1|/L0, from 0
// (all sides) to 1 (one direction). `direction` is `fallback` if there is no light or no direction.
struct DominantLight {
  Vec3 direction;
  float focus;
};
DominantLight dominant_light(const ShL1Texel& texel, const Vec3& fallback);

// Roughness at which a small lamp looks like a light of this focus: smoothness (1 - roughness) is
// multiplied by sqrt(focus). (O'Donnell 2018, Precomputed Global Illumination in Frostbite.)
float softened_roughness(float roughness, float focus);

// Approximate specular reflection (O'Donnell 2018): one lamp in the dominant direction, with the irradiance
// that the linear reconstruction gives a surface facing it, reflected by GGX (height-correlated Smith,
// Schlick) at the softened roughness. `to_eye`: unit; `f0`: reflectance at normal incidence. Returns radiance
// in the unit of L0; 0 where the lamp or the eye is behind the surface. Limits: one direction only, so the
// highlight of two lights lies between them. Departure: alpha is at least 1e-3, as in engines, to stay
// finite.
Vec3 specular_from_l1(const ShL1Texel& texel, const Vec3& n, const Vec3& to_eye, float roughness,
                      const Vec3& f0);

}  // namespace kiln
