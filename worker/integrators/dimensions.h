// Assigns random-number dimensions to the decisions of a path.
#pragma once

#include "common/math/vec.h"

namespace kiln {

// Dimension pairs of the vertex after `bounces` reflections. Dimension 0 picks the texel's site.
enum Dimension : uint32_t {
  kDirection,
  kLayer,
  kLocalLight,
  kLocalPoint,
  kSun,
  kSunPoint,
  kEnvironment,
  kPerVertex
};
constexpr uint32_t dimension(uint32_t bounces, Dimension d) {
  return 1 + bounces * kPerVertex + d;
}

// PrimaryRay::weight for a direction with that cosine, drawn with density `pdf`.
inline float primary_weight(float cosine, float pdf) {
  return cosine / (kPi * pdf);
}

}  // namespace kiln
