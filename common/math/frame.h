#pragma once

#include "common/math/vec.h"

namespace kiln {

// Right-handed orthonormal frame around a unit normal.
// Duff et al. 2017, Building an Orthonormal Basis, Revisited, JCGT 6(1), listing 3.
struct Frame {
  Vec3 x, y, n;
  explicit Frame(const Vec3& normal) : n(normal) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    x = Vec3(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x);
    y = Vec3(b, sign + n.y * n.y * a, -n.y);
  }
  Vec3 to_world(const Vec3& v) const { return x * v.x + y * v.y + n * v.z; }
  Vec3 to_local(const Vec3& v) const { return {dot(v, x), dot(v, y), dot(v, n)}; }
};

}  // namespace kiln
