// Physical limits on filtered light.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "common/base/check.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln {

// Clamps light below zero and directions longer than their light, which regression may produce near borders.
inline void hold_bounds(std::span<const DirectionBound> bounds, float* plane, size_t planes) {
  for (size_t p = 0; p < std::min<size_t>(3, planes); ++p) plane[p] = std::max(plane[p], 0.0f);
  for (const DirectionBound& b : bounds) {
    plane[b.light] = std::max(plane[b.light], 0.0f);
    const DVec3 d(plane[b.direction[0]], plane[b.direction[1]], plane[b.direction[2]]);
    const double size = length(d), light = plane[b.light];
    if (!(size > light)) continue;
    const double factor = light / size * (1 - 0x1p-23);
    for (int axis = 0; axis < 3; ++axis) plane[b.direction[axis]] = static_cast<float>(d[axis] * factor);
  }
}

}  // namespace kiln
