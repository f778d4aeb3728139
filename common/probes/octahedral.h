// Octahedral maps of the sphere (Cigolle et al. 2014, A Survey of Efficient Representations for Independent
// Unit Vectors, listings 1 and 2), as probes store them: the pole is +z, texel (x, y) of a side of N texels
// has its centre at ((x + 1/2) / N, (y + 1/2) / N). Stored with a border of one texel on every side, which is
// not counted in N, so that bilinear lookups need no other probe's texels.
#pragma once

#include <cstdint>

#include "common/math/vec.h"

namespace kiln {

// A unit direction to the unit square.
inline Vec2 octahedral_place(const Vec3& d) {
  const float sum = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  Vec2 p(d.x / sum, d.y / sum);
  if (d.z < 0.0f)
    p = Vec2((1.0f - std::abs(p.y)) * (p.x < 0.0f ? -1.0f : 1.0f),
             (1.0f - std::abs(p.x)) * (p.y < 0.0f ? -1.0f : 1.0f));
  return p * 0.5f + Vec2(0.5f);
}

// A point of the unit square to its unit direction.
inline Vec3 octahedral_direction(const Vec2& place) {
  const Vec2 p = place * 2.0f - Vec2(1.0f);
  Vec3 v(p.x, p.y, 1.0f - std::abs(p.x) - std::abs(p.y));
  if (v.z < 0.0f) {
    const float x = (1.0f - std::abs(p.y)) * (p.x < 0.0f ? -1.0f : 1.0f);
    v.y = (1.0f - std::abs(p.x)) * (p.y < 0.0f ? -1.0f : 1.0f);
    v.x = x;
  }
  return v / length(v);
}

inline Vec3 octahedral_texel(uint32_t x, uint32_t y, uint32_t side) {
  const auto n = static_cast<float>(side);
  return octahedral_direction({(static_cast<float>(x) + 0.5f) / n, (static_cast<float>(y) + 0.5f) / n});
}

// The texel inside whose value a texel of the bordered map has: coordinates run from 0 to side + 1 and become
// 0 to side - 1. Across an edge the map continues into the same edge, mirrored; corners are all one point.
inline void octahedral_inside(uint32_t side, uint32_t& x, uint32_t& y) {
  const bool across_x = x == 0 || x == side + 1, across_y = y == 0 || y == side + 1;
  if (across_x) y = side + 1 - y;
  if (across_y) x = side + 1 - x;
  x = std::min(std::max(x, 1u), side) - 1;
  y = std::min(std::max(y, 1u), side) - 1;
}

}  // namespace kiln
