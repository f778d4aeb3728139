// A triangle in texel coordinates and the rasterisers' queries on it. All in double: a site's barycentrics
// must agree with its mask (Roughton 2019, section 4.3: "high precision").
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include "common/math/vec.h"

namespace kiln {

struct Triangle2 {
  DVec2 c[3];

  double min_x() const { return std::min({c[0].x, c[1].x, c[2].x}); }
  double max_x() const { return std::max({c[0].x, c[1].x, c[2].x}); }
  double min_y() const { return std::min({c[0].y, c[1].y, c[2].y}); }
  double max_y() const { return std::max({c[0].y, c[1].y, c[2].y}); }
};

// Twice the signed area of (a, b, q).
inline double area2(const DVec2& a, const DVec2& b, const DVec2& q) {
  return (b.x - a.x) * (q.y - a.y) - (b.y - a.y) * (q.x - a.x);
}
inline double area2(const Triangle2& t) {
  return area2(t.c[0], t.c[1], t.c[2]);
}

struct XRange {
  double lo = std::numeric_limits<double>::infinity(), hi = -lo;
  bool empty() const { return !(lo <= hi); }
};

// Extent in x of the part of `t` with y0 <= y <= y1. The part is convex and its extremes lie on the
// triangle's edges, so a box overlaps the triangle exactly when its x interval meets this range.
inline XRange x_range_in_strip(const Triangle2& t, double y0, double y1) {
  XRange range;
  for (int k = 0; k < 3; ++k) {
    const DVec2 *a = &t.c[k], *b = &t.c[(k + 1) % 3];
    if (a->y > b->y) std::swap(a, b);
    if (b->y < y0 || a->y > y1) continue;
    const double slope = b->y > a->y ? (b->x - a->x) / (b->y - a->y) : 0.0;
    const double xa = a->y >= y0 ? a->x : a->x + (y0 - a->y) * slope;
    const double xb = b->y <= y1 ? b->x : a->x + (y1 - a->y) * slope;
    range.lo = std::min({range.lo, xa, xb});
    range.hi = std::max({range.hi, xa, xb});
  }
  return range;
}

// True if the interiors of two triangles overlap by more than `contact` (a length). Separating axes: for
// convex shapes in the plane the six edge normals suffice.
inline bool interiors_meet(const Triangle2& a, const Triangle2& b, double contact) {
  const auto separated = [contact](const Triangle2& t, const Triangle2& other) {
    const double sign = area2(t) < 0 ? -1.0 : 1.0;
    for (int k = 0; k < 3; ++k) {
      const DVec2 &p = t.c[k], &q = t.c[(k + 1) % 3];
      const double inside = contact * std::sqrt(dot(q - p, q - p));
      if (std::max({sign * area2(p, q, other.c[0]), sign * area2(p, q, other.c[1]),
                    sign * area2(p, q, other.c[2])}) <= inside)
        return true;
    }
    return false;
  };
  return !separated(a, b) && !separated(b, a);
}

}  // namespace kiln
