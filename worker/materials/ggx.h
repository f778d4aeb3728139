// The GGX microfacet lobe, isotropic: Heitz 2014, Understanding the Masking-Shadowing Function
// (height-correlated Smith), and Dupuy & Benyoub 2023, Sampling Visible GGX Normals with Spherical Caps, CGF
// 42(8), listing 3. Directions are local, z along the normal; written without division by a cosine, which may
// be tiny.
#pragma once

#include "common/math/warp.h"

namespace kiln {

// Narrower lobes than this width (roughness 0.14) look the same to a diffuse receiver and only add noise.
constexpr float kLeastAlpha = 0.02f;
// GGX width of a perceptual roughness.
inline float ggx_alpha(float roughness) {
  return std::max(kLeastAlpha, roughness * roughness);
}

// (1 - cos)^5 of Schlick's reflectance f0 + (f90 - f0) (1 - cos)^5.
inline float fifth_power_of_rest(float cos) {
  const float m = std::clamp(1.0f - cos, 0.0f, 1.0f);
  const float m2 = m * m;
  return m2 * m2 * m;
}

// Density D of normals around h, per steradian.
inline float ggx_d(const Vec3& h, float alpha) {
  const float a2 = alpha * alpha;
  const float t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;  // (1 - z^2) + a^2 z^2 without cancellation
  return a2 * kInvPi / (t * t);
}

// cos x (1 + 2 Lambda), from which Smith's terms are made.
inline float ggx_smith(float cos, float alpha) {
  const float a2 = alpha * alpha;
  return std::sqrt(a2 + (1.0f - a2) * cos * cos);
}

// In the stretched space where the surface is a hemisphere, the reflections of wo off its visible normals
// fill a cap uniformly.
inline Vec3 ggx_visible_normal(const Vec3& wo, float alpha, const Vec2& u) {
  const Vec3 v = normalize_or(Vec3(alpha * wo.x, alpha * wo.y, wo.z), Vec3(0, 0, 1));
  const Vec3 n = v + spherical(1.0f - u.x * (1.0f + v.z), u.y);
  return normalize_or(Vec3(alpha * n.x, alpha * n.y, std::max(1e-6f, n.z)), Vec3(0, 0, 1));
}
// Mirrors wo at such a normal; may lie below the horizon.
inline Vec3 ggx_reflection(const Vec3& wo, float alpha, const Vec2& u) {
  const Vec3 h = ggx_visible_normal(wo, alpha, u);
  return h * (2.0f * dot(wo, h)) - wo;
}

// Height-correlated G2 / (4 cos cos).
inline float ggx_visibility(float cos_o, float smith_o, float cos_i, float smith_i) {
  return 0.5f / (cos_o * smith_i + cos_i * smith_o);
}
// Density of ggx_reflection(): that of visible normals, G1 max(0, wo.h) D / wo.z, times the Jacobian
// 1/(4 wo.h), where G1 / wo.z = 2 / (wo.z + smith(wo)).
inline float ggx_reflection_pdf(float d, float cos_o, float smith_o) {
  return d / (2.0f * (cos_o + smith_o));
}

}  // namespace kiln
