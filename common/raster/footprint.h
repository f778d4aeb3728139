// Texels that a bilinear lookup inside a triangle can read: those whose 2x2-texel box around the centre
// overlaps the triangle. (O'Donnell 2018, chart masks; Roughton 2019, 4.1.2.)
#pragma once

#include "common/raster/triangle2.h"

namespace kiln {

// The box is smaller by this on every side, so that a chart border laid on texel centres does not claim
// the next row. More than float rounding of a placement on a page of 16384 (0.001), less than the 8-bit
// filter weights of a texture unit resolve (1/256).
constexpr double kFootprintShrink = 1.0 / 512;

// Calls visit(y, first x, last x) for each row of an image of width x height with such texels.
template <class Visit>
void for_each_footprint_span(const Triangle2& t, uint32_t width, uint32_t height, const Visit& visit) {
  constexpr double kAbove = 1.5 - kFootprintShrink, kBelow = 0.5 - kFootprintShrink;
  // Texels x with x + kAbove > lo and x - kBelow < hi.
  const auto first = [](double lo) { return std::max(0.0, std::floor(lo - kAbove) + 1); };
  const auto last = [](double hi, uint32_t size) { return std::min(size - 1.0, std::ceil(hi + kBelow) - 1); };
  const double bottom = last(t.max_y(), height);
  for (double y = first(t.min_y()); y <= bottom; ++y) {
    const XRange range = x_range_in_strip(t, y - kBelow, y + kAbove);
    if (range.empty()) continue;
    const double x0 = first(range.lo), x1 = last(range.hi, width);
    if (x0 <= x1) visit(static_cast<uint32_t>(y), static_cast<uint32_t>(x0), static_cast<uint32_t>(x1));
  }
}

}  // namespace kiln
