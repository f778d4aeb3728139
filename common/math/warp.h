// Maps from the unit square, each with its density.
#pragma once

#include "common/math/trig.h"
#include "common/math/vec.h"

namespace kiln {

inline Vec3 spherical(float z, float turns) {
  const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  const SinCos a = sincos_turns(turns);
  return {r * a.cos, r * a.sin, z};
}

// Cosine-weighted hemisphere around +z; pdf = z / pi per steradian.
inline Vec3 cosine_hemisphere(const Vec2& u) {
  return spherical(std::sqrt(1.0f - u.x), u.y);
}

// The primary density of a texel: half uniform, half cosine over the hemisphere around +z, in one smooth
// warp. pdf = (1 + 2 z) / (4 pi). Reason: uniform directions suit the L0 and L1 moments, the cosine suits E;
// the mixture bounds both weights (L/(4 pi pdf) <= L, L z/pdf <= 4 pi/3 L). The marginal of z has the
// distribution function (z + z^2)/2, inverted below in a form without cancellation near 0.
inline Vec3 mixed_hemisphere(const Vec2& u) {
  const float z = 4.0f * u.x / (1.0f + std::sqrt(1.0f + 8.0f * u.x));
  return spherical(std::min(z, 1.0f), u.y);
}
inline float mixed_hemisphere_pdf(float z) {
  return z > 0.0f ? (1.0f + 2.0f * z) * (0.25f * kInvPi) : 0.0f;
}

// Candidate densities for a texel's primary directions; docs/performance.md compares them. Bakes of texels
// use the first. kSphere is for receivers that face every way: uniform over the sphere, whose upper half is
// that of the numbers with u.x < 1/2. The receiver's normal is the axis of the half that a sample falls into.
enum class PrimaryDensity : uint8_t { kMixed, kCosine, kUniform, kSphere };

inline bool is_upper_half(const Vec2& u) {
  return u.x < 0.5f;
}

inline Vec3 primary_direction(PrimaryDensity density, const Vec2& u) {
  if (density == PrimaryDensity::kMixed) [[likely]]
    return mixed_hemisphere(u);
  if (density == PrimaryDensity::kSphere) return spherical(is_upper_half(u) ? 2 * u.x : 2 * u.x - 1, u.y);
  return density == PrimaryDensity::kCosine ? cosine_hemisphere(u) : spherical(u.x, u.y);
}
inline float primary_pdf(PrimaryDensity density, float z) {
  if (density == PrimaryDensity::kMixed) [[likely]]
    return mixed_hemisphere_pdf(z);
  return z > 0.0f ? (density == PrimaryDensity::kCosine ? z * kInvPi : 0.5f * kInvPi) : 0.0f;
}

// Uniform in a cone around +z with 1 - cos(half angle) = h; pdf = 1 / (2 pi h).
inline Vec3 uniform_cone(const Vec2& u, float h) {
  const float one_minus_z = u.x * h;
  const float r = std::sqrt(std::max(0.0f, one_minus_z * (2.0f - one_minus_z)));
  const SinCos a = sincos_turns(u.y);
  return {r * a.cos, r * a.sin, 1.0f - one_minus_z};
}

// Barycentrics (of vertices 1 and 2), uniform over a triangle. Heitz 2019, A Low-Distortion Map Between
// Triangle and Square.
inline Vec2 uniform_triangle(const Vec2& u) {
  float x = u.x, y = u.y;
  if (y > x) {
    x *= 0.5f;
    y -= x;
  } else {
    y *= 0.5f;
    x -= y;
  }
  return {x, y};
}

}  // namespace kiln
