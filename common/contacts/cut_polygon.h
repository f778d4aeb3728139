// Polygons that triangles are split into where other surfaces stand on them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/math/vec.h"

namespace kiln::cut {

// Barycentrics are whole multiples of this, so that 1 - t is exact and the two triangles at a side have the
// same points on it.
constexpr double kGrid = 1 << 23;
inline double on_grid(double t) {
  return std::round(std::clamp(t, 0.0, 1.0) * kGrid) / kGrid;
}

using PointKey = std::array<uint64_t, 3>;

struct Point {
  DVec2 at;    // metres in the triangle's plane
  DVec2 bary;  // (b1, b2)
  uint32_t id;
};
// side[k]: of the triangle's sides 0 (corner 0 to 1), 1, 2 that polygon side k (point k to k + 1) lies on;
// -1: none.
struct Polygon {
  uint32_t triangle;
  std::vector<Point> points;
  std::vector<int> side;
};

// One triangle laid into the plane, in metres of the world.
struct Flat {
  DVec2 corner[3] = {DVec2(0.0), DVec2(0.0), DVec2(0.0)};
  DVec2 at(const DVec2& b) const {
    return corner[0] + b.x * (corner[1] - corner[0]) + b.y * (corner[2] - corner[0]);
  }
};

}  // namespace kiln::cut
