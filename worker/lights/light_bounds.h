#pragma once

#include <limits>

#include "common/math/vec.h"

namespace kiln {

// What the light tree knows about one light, as in Conty Estevez & Kulla 2018, section 4: it lies within a
// sphere; its normals lie within a cone around `axis`; light leaves within a further angle of a normal.
// Bounds may be too large but never too small: directions they exclude are not sampled.
struct LightBounds {
  Vec3 centre{0.0f};
  float radius = 0.0f;
  Vec3 axis{0.0f, 1.0f, 0.0f};  // unit
  double cos_normals = -1.0;    // cosine of the cone's half angle; -1: every direction
  double cos_emission = 0.0;    // cosine of the further angle, at most a right angle
  bool two_sided = false;       // also emits the same around -axis
  double strength = 0.0;        // peak luminous intensity, in any consistent unit; only steers sampling
  float reach = std::numeric_limits<float>::infinity();  // no light arrives further than this from the sphere
};

}  // namespace kiln
