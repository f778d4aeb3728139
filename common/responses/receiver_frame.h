// The tangent frame of bases that are stored relative to the surface: a function of the shading normal
// alone, so that engines need no tangents and agree with the bake by construction
// (docs/shaders/kiln_bases.glsl).
#pragma once

#include "common/math/vec.h"

namespace kiln {

// Right-handed and orthonormal, z = n: a fixed frame about the pole q = (2, 3, 6) / 7, turned along the
// shortest arc from q to n. It is continuous in n everywhere but at -q, which walls and floors do not have as
// their normal. A frame with signs of coordinates in it (Duff et al. 2017) would turn within a texel wherever
// a wall's normal has a zero with noise.
struct ReceiverFrame {
  Vec3 x, y, n;
  explicit ReceiverFrame(const Vec3& normal) : n(normal) {
    const Vec3 q(2.0f / 7, 3.0f / 7, 6.0f / 7), across(3.0f / 7, -6.0f / 7, 2.0f / 7);
    const float above = 1.0f + dot(q, n);
    // At -q any frame does.
    x = above > 1e-6f ? across - (q + n) * (dot(across, n) / above) : across;
    y = cross(n, x);
  }
  Vec3 to_local(const Vec3& v) const { return {dot(v, x), dot(v, y), dot(v, n)}; }
};

}  // namespace kiln
