// The 64 points of a texel as a constexpr table: the rasteriser does not depend on initialisation order.
#pragma once

#include <array>
#include <cstdint>

namespace kiln {

// Six bits reversed: the radical inverse of the 64-point Hammersley set, times 64.
constexpr uint32_t reverse6(uint32_t j) {
  uint32_t r = 0;
  for (uint32_t bit = 0; bit < 6; ++bit) r |= (j >> bit & 1) << (5 - bit);
  return r;
}

struct SitePoints {
  std::array<double, 64> x, y;
};
constexpr SitePoints make_site_points() {
  SitePoints p{};
  for (uint32_t j = 0; j < 64; ++j) {
    p.x[j] = (j + 0.5) / 64;
    p.y[j] = (reverse6(j) + 0.5) / 64;
  }
  return p;
}
inline constexpr SitePoints kSitePoints = make_site_points();

}  // namespace kiln
