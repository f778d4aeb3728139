// Which of the 64 site points of each texel lie in a triangle. (Roughton 2019, 4.2; seed of the idea:
// O'Donnell 2018, "Precomputed Global Illumination in Frostbite", texel sampling.)
#pragma once

#include <array>

#include "common/raster/triangle2.h"

namespace kiln {

struct TexelRect {
  int64_t x0, y0, x1, y1;  // half-open
};

// One side of a triangle. The line is evaluated from its lexicographically smaller end, so the two
// triangles at a shared edge compute the same bits; a point on the line counts as on its positive side.
// This equals moving every point by (-d^2, d) for infinitesimal d: each point of a tessellated area lies in
// exactly one triangle, on edges and at corners too.
class HalfPlane {
 public:
  HalfPlane(const DVec2& from, const DVec2& to, bool positive);
  // Points of texel (x, y) on the inner side.
  uint64_t mask(double x, double y) const;

 private:
  DVec2 origin_, d_;
  double least_, most_, margin_;  // of the line's value over a texel, from its value at the low corner
  bool positive_;
};

struct CoverageTest {
  explicit CoverageTest(const Triangle2& t);
  uint64_t mask(double x, double y) const {
    uint64_t m = sides[0].mask(x, y);
    if (m) m &= sides[1].mask(x, y);
    if (m) m &= sides[2].mask(x, y);
    return m;
  }
  std::array<HalfPlane, 3> sides;
};

// Calls visit(x, y, mask) for each texel of `clip` with a point of `t`, row by row. A triangle without
// area has none.
template <class Visit>
void for_each_cover(const Triangle2& t, const TexelRect& clip, const Visit& visit) {
  if (area2(t) == 0) return;
  const CoverageTest test(t);
  const double left = static_cast<double>(clip.x0), right = static_cast<double>(clip.x1 - 1);
  const double top = std::max(std::floor(t.min_y()), static_cast<double>(clip.y0));
  const double bottom = std::min(std::floor(t.max_y()), static_cast<double>(clip.y1 - 1));
  for (double y = top; y <= bottom; ++y) {
    const XRange range = x_range_in_strip(t, y, y + 1);
    if (range.empty()) continue;
    constexpr double kSlack = 1e-6;  // rounding of the range: an extra texel costs one test
    const double first = std::max(std::floor(range.lo - kSlack), left);
    const double last = std::min(std::floor(range.hi + kSlack), right);
    for (double x = first; x <= last; ++x)
      if (const uint64_t mask = test.mask(x, y))
        visit(static_cast<uint32_t>(x), static_cast<uint32_t>(y), mask);
  }
}

}  // namespace kiln
