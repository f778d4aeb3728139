// Which random numbers a path reads for what.
#pragma once

#include "common/math/vec.h"

namespace kiln {

// Pairs of dimensions of the vertex after `bounces` reflections. Dimension 0 picks the texel's site.
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

// PrimaryRay::weight of a direction of that cosine, drawn with density `pdf`.
inline float primary_weight(float cosine, float pdf) {
  return cosine / (kPi * pdf);
}

}  // namespace kiln
