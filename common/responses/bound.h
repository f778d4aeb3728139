// What finish() of a basis does that is linear in its functions: numbers that ratio textures hold, and E
// itself at the surface's normal.
#pragma once

#include "common/math/vec.h"

namespace kiln {

struct ExactAt {
  float e;  // irradiance at the normal
  Vec3 n;
  float (*irradiance)(const float* f, const Vec3& n, const Vec3& m);
  int count;  // of functions; function 0 is the constant, of irradiance pi at every normal
};

// Scales functions 1 ... by one factor <= 1 and sets function 0, so that irradiance(f, n, n) is e and no
// other function is larger than function 0, nor the vector of functions 1, 2 and 3 longer. Where there is no
// light, all become 0.
void hold_exactly(const ExactAt& at, float* f);

}  // namespace kiln
