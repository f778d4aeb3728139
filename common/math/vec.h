// The only GLM include. Scalar code, no SIMD types: the layout is the stored layout.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace kiln {

using Vec2 = glm::vec2;
using Vec3 = glm::vec3;
using Vec4 = glm::vec4;
using DVec2 = glm::dvec2;
using DVec3 = glm::dvec3;
using UVec3 = glm::uvec3;
using Mat3 = glm::mat3;
using Mat4x3 = glm::mat4x3;  // affine: columns x, y, z axis and origin
using glm::cross;
using glm::dot;
using glm::length;

inline Vec3 transform_point(const Mat4x3& m, const Vec3& p) {
  return m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3];
}
inline Vec3 transform_vector(const Mat4x3& m, const Vec3& v) {
  return m[0] * v.x + m[1] * v.y + m[2] * v.z;
}
inline float determinant(const Mat4x3& m) {
  return dot(m[0], cross(m[1], m[2]));
}
// Cofactor matrix times n: the direction of a transformed normal (not unit). Multiply by the sign of the
// determinant to stay on the outer side under mirroring.
inline Vec3 transform_normal(const Mat4x3& m, const Vec3& n) {
  const Vec3 r = cross(m[1], m[2]) * n.x + cross(m[2], m[0]) * n.y + cross(m[0], m[1]) * n.z;
  return determinant(m) < 0 ? -r : r;
}
// Unit vector along v, or `fallback` when v has no direction.
inline Vec3 normalize_or(const Vec3& v, const Vec3& fallback) {
  const float square = dot(v, v);
  if (square > 1e-30f && square < 1e30f) return v / std::sqrt(square);
  // Scaled by the largest component first: no overflow or underflow of the square.
  const float largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0.0f) || !std::isfinite(largest)) return fallback;
  const Vec3 s = v / largest;
  return s / std::sqrt(dot(s, s));
}
inline bool is_finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
inline float max_component(const Vec3& v) {
  return std::max({v.x, v.y, v.z});
}
// Rec. 709 luminance of linear RGB, in the unit of the argument.
inline float luminance(const Vec3& rgb) {
  return 0.2126f * rgb.x + 0.7152f * rgb.y + 0.0722f * rgb.z;
}
inline double luminance(const DVec3& rgb) {
  return 0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z;
}

constexpr float kPi = 3.14159265358979323846f;
constexpr float kInvPi = 0.31830988618379067154f;

}  // namespace kiln
