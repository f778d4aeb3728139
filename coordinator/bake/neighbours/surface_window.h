// The sites around a site on its surface.
#pragma once

#include <array>

#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

// Walks the graph, so it never reaches texels behind a wall or past an edge, however close. One per thread,
// because it keeps scratch memory.
class SurfaceWindow {
 public:
  static constexpr uint32_t kMax = 160;               // sites; enough for a radius of 7 texels
  static constexpr float kMinCosine = kWindowCosine;  // between the shading normals

  // Both outlive the window.
  SurfaceWindow(const SiteGeometry& sites, const SurfaceLinks& links) : sites_(sites), links_(links) {}

  // The site itself, then sites around it in rings of links: within `radius` metres, shading normals within
  // 25 degrees, off the tangent plane by at most a quarter of `radius` plus a quarter of a texel, texel sizes
  // alike; connected through such sites. At most `most` <= kMax. Takes about 15 ns per site found.
  std::span<const uint32_t> around(uint32_t site, float radius, uint32_t most = kMax);

 private:
  static constexpr uint32_t kSlots =
      1024;  // a power of two above the number of sites visited, which is 4 kMax and a few more
  bool seen(uint32_t site);  // marks the site

  const SiteGeometry& sites_;
  const SurfaceLinks& links_;
  struct Slot {
    uint32_t site = 0, round = 0;
  };
  std::array<Slot, kSlots> slots_{};
  uint32_t round_ = 0;
  std::array<uint32_t, kMax> found_{};
};

}  // namespace kiln
