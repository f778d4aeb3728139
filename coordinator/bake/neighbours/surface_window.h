// The sites around a site on its surface.
#pragma once

#include <array>

#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

// Walks the graph, so that nothing behind a wall or beyond an edge is found, however near. One to a thread:
// what it needs to walk is kept.
class SurfaceWindow {
 public:
  static constexpr uint32_t kMax = 160;      // sites; those of 7 texels' radius
  static constexpr float kMinCosine = 0.9f;  // between the shading normals

  // Both outlive the window.
  SurfaceWindow(const SiteGeometry& sites, const SurfaceLinks& links) : sites_(sites), links_(links) {}

  // The site itself, then those around it in rings of links: within `radius` metres, shading normals within
  // 25 degrees, no further off the tangent plane than a quarter of `radius` and a quarter of a texel, texel
  // sizes within a factor of 3; connected through such sites. At most `most` <= kMax. About 15 ns a site
  // found.
  std::span<const uint32_t> around(uint32_t site, float radius, uint32_t most = kMax);

 private:
  static constexpr uint32_t kSlots = 1024;  // a power of two above what is looked at: 4 kMax and more
  bool seen(uint32_t site);                 // and from now on it is

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
