// Texel density requested by a scene file. Import fills it, density.h reads it.
#pragma once

#include <vector>

#include "common/math/vec.h"

namespace kiln {

// Density factors are clamped to these, one by one and as a product.
constexpr double kMinDensityFactor = 1.0 / 64, kMaxDensityFactor = 64;

// An axis-aligned box in world space, metres, low <= high.
struct ImportanceBox {
  DVec3 low{0.0}, high{0.0};
  double factor = 1;  // above 0
};

// A viewpoint, looking along -z, +y up, with unit axes.
struct Viewpoint {
  Mat4x3 to_world{1.0f};
  float vertical_fov = 0.8f;    // radians, below pi
  float aspect = 16.0f / 9.0f;  // width / height
};

struct DensityWishes {
  std::vector<float> by_instance;  // node chain x mesh x material; empty: not given
  std::vector<ImportanceBox> boxes;
  std::vector<Viewpoint> cameras;  // every perspective camera of the scene
};

}  // namespace kiln
