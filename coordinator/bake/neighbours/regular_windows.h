// Windows in the midst of flat surfaces, where sites lie on a grid: all have the same shape.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "coordinator/bake/neighbours/surface_window.h"

namespace kiln {

class RegularWindows {
 public:
  static constexpr float kTexels = 6.4f;  // radius

  // The places of a window's sites on the grid, in texels from its middle, by distance: its middle first.
  struct Shape {
    size_t count = 0;
    std::array<int8_t, SurfaceWindow::kMax> x{}, y{};
    std::array<float, SurfaceWindow::kMax> square{};  // of the distance
    // A place one step nearer to the middle, and the direction from there: right, left, up, down.
    std::array<uint8_t, SurfaceWindow::kMax> before{}, way{};
    // The middle, and places nearer than this.
    size_t within(float texels) const;
  };
  static const Shape& shape();

  // Looks at all sites: those are regular around which all links of a window are to sites on a square grid,
  // with the same normal. Takes a twentieth of a microsecond a site.
  RegularWindows(const SiteGeometry& sites, const SurfaceLinks& links, unsigned threads);

  // Writes the first `count` sites of a regular site's window to `out`, in the order of shape(). False: it is
  // not regular, or one of these is not known (`known`: by site).
  bool find(uint32_t site, std::span<const uint8_t> known, size_t count, std::span<uint32_t> out) const;

 private:
  static constexpr size_t kWays = 4;
  using Beside = std::array<uint32_t, kWays>;  // sites by way
  bool walk(uint32_t site, size_t count, std::span<uint32_t> out) const;

  std::vector<Beside> beside_;       // by site; [0] is kNone where links are no grid
  std::vector<uint8_t> is_regular_;  // by site
};

}  // namespace kiln
