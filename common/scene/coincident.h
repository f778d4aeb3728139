// Triangles that lie exactly on each other: the same three corners, in any rotation and either winding.
#pragma once

#include <bit>

#include "common/math/sequence.h"
#include "common/math/vec.h"

namespace kiln {

// A key that is equal for equal corners in any order; -0 counts as 0.
inline uint64_t corner_hash(const Vec3 (&p)[3]) {
  uint64_t sum = 0;
  for (const Vec3& c : p) {
    const auto bits = [](float v) { return std::bit_cast<uint32_t>(v + 0.0f); };
    sum += mix_bits((uint64_t{bits(c.x)} << 32 | bits(c.y)) ^ mix_bits(bits(c.z)));
  }
  return mix_bits(sum);
}

// 1: the same corners in the same winding; -1: in the other; 0: other corners.
inline int same_corners(const Vec3 (&a)[3], const Vec3 (&b)[3]) {
  for (int k = 0; k < 3; ++k) {
    if (a[0] != b[k]) continue;
    if (a[1] == b[(k + 1) % 3] && a[2] == b[(k + 2) % 3]) return 1;
    if (a[1] == b[(k + 2) % 3] && a[2] == b[(k + 1) % 3]) return -1;
  }
  return 0;
}

}  // namespace kiln
