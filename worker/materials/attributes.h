#pragma once

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/scene/record_reader.h"
#include "common/scene/scene.h"
#include "worker/materials/texture_sampler.h"

namespace kiln {

// Interpolated mesh attributes at a point, as materials need them.
struct Attributes {
  Vec2 uv[2] = {Vec2(0.0f), Vec2(0.0f)};
  Vec4 color{1.0f};
};

// Clamps a number of a file to [low, high]; NaN becomes low.
inline float within(float x, float low, float high) {
  return x > low ? std::min(x, high) : low;
}
inline Vec3 within(const Vec3& v, float low, float high) {
  return {within(v.x, low, high), within(v.y, low, high), within(v.z, low, high)};
}

// The factors of a material's emission, to integrate it over a triangle.
struct EmissionParts {
  Vec3 factor;
  const TextureSampler* texture;  // null: none
  bool vertex_color;              // times Attributes::color
};

}  // namespace kiln
