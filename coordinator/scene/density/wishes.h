// What a scene file says about the density of its texels. Import fills it, density.h reads it.
#pragma once

#include <vector>

#include "common/math/vec.h"

namespace kiln {

// A factor on density is kept within these, one by one and as a product.
constexpr double kMinDensityFactor = 1.0 / 64, kMaxDensityFactor = 64;

// A part of the world, metres along the axes, low <= high.
struct ImportanceBox {
  DVec3 low{0.0}, high{0.0};
  double factor = 1;  // above 0
};

// Where somebody looks from: along -z, +y up; the axes are unit.
struct Viewpoint {
  Mat4x3 to_world{1.0f};
  float vertical_fov = 0.8f;    // radians, below pi
  float aspect = 16.0f / 9.0f;  // width / height
};

struct DensityWishes {
  std::vector<float> by_instance;  // node chain x mesh x material; empty: nothing was said
  std::vector<ImportanceBox> boxes;
  std::vector<Viewpoint> cameras;  // every perspective camera of the scene
};

}  // namespace kiln
