#pragma once

#include "common/math/vec.h"

namespace kiln {

// How a light takes part (extras.kiln.bake). indirect: only after a reflection.
enum class BakeMode { kFull, kIndirect, kNone };

// A chosen light and a direction to it.
struct LightSample {
  Vec3 direction;      // unit, from the receiver to the light
  Vec3 segment{0.0f};  // receiver + segment lies just before the light, unless
  bool far = false;    // the light is at infinity
  Vec3 weight{0.0f};   // radiance / pdf; for delta lights, irradiance on a facing surface / probability
  float pdf = 0.0f;    // per steradian, including the choice of light; 0: delta
  bool indirect_only = false;
};

}  // namespace kiln
