// Transforms in double, so that deep hierarchies lose nothing before the scene's floats.
#pragma once

#include "common/math/vec.h"

namespace kiln {

struct Affine {
  DVec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, origin{0, 0, 0};

  DVec3 vector(const DVec3& v) const { return x * v.x + y * v.y + z * v.z; }
  DVec3 point(const DVec3& p) const { return vector(p) + origin; }
};

// Applies b first, then a.
inline Affine operator*(const Affine& a, const Affine& b) {
  return {a.vector(b.x), a.vector(b.y), a.vector(b.z), a.point(b.origin)};
}

// glTF's order: scale, then rotation (quaternion x, y, z, w; normalised here), then translation.
inline Affine from_trs(const DVec3& translation, const double (&q)[4], const DVec3& scale) {
  double x = q[0], y = q[1], z = q[2], w = q[3];
  const double size = std::sqrt(x * x + y * y + z * z + w * w);
  if (size > 0) {
    x /= size, y /= size, z /= size, w /= size;
  } else {
    w = 1;
  }
  return {DVec3(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)) * scale.x,
          DVec3(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)) * scale.y,
          DVec3(2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)) * scale.z, translation};
}

inline Mat4x3 to_float(const Affine& a) {
  return Mat4x3(Vec3(a.x), Vec3(a.y), Vec3(a.z), Vec3(a.origin));
}

inline bool is_finite(const Affine& a) {
  const Mat4x3 m = to_float(a);
  return is_finite(m[0]) && is_finite(m[1]) && is_finite(m[2]) && is_finite(m[3]);
}

// True when the axes, rounded to float as the scene stores them, lie in a plane or vanish.
inline bool is_singular(const Affine& a) {
  constexpr double kUlp = 0x1p-23;
  const double volume = std::abs(dot(a.x, cross(a.y, a.z)));
  return !(volume > kUlp * length(a.x) * length(a.y) * length(a.z)) ||
         !(std::abs(determinant(to_float(a))) > 0);
}

// The rotation and translation of a light's or camera's node: unit axes, -z preserved, scale and shear
// removed. False when the z axis has no direction.
inline bool rigid_part(const Affine& a, Mat4x3& out) {
  const Vec3 z = normalize_or(Vec3(a.z), Vec3(0));
  if (z == Vec3(0) || !is_finite(a)) return false;
  const Vec3 side = std::abs(z.x) < 0.5f ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
  // y takes precedence over x, so that a camera stays upright.
  const Vec3 y0 = normalize_or(Vec3(a.y), side);
  const Vec3 x = normalize_or(cross(y0, z), normalize_or(cross(side, z), Vec3(1, 0, 0)));
  out = Mat4x3(x, cross(z, x), z, Vec3(a.origin));
  return true;
}

}  // namespace kiln
