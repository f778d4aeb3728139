// The graph of texel sites that are neighbours on a surface.
#pragma once

#include <span>

#include "coordinator/bake/neighbours/site_geometry.h"
#include "coordinator/bake/seams/match.h"

namespace kiln {

// Sites linked with a site, ascending; links go both ways.
struct SurfaceLinks {
  std::vector<uint32_t> first;  // by site, size + 1: index into link
  std::vector<uint32_t> link;
  std::span<const uint32_t> of(uint32_t site) const {
    return {link.data() + first[site], link.data() + first[site + 1]};
  }
};

// What a window may hold (surface_window.h): shading normals within 25 degrees of the centre's, texel sizes
// within a factor of 3 of its.
constexpr float kWindowCosine = 0.9f;
constexpr float kWindowSizes = 3.0f;
inline bool sizes_alike(float a, float b) {
  return a <= kWindowSizes * b && b <= kWindowSizes * a;
}

// Links each texel with its four neighbours on the same chart, and texels on either side of a seam
// (coordinator/bake/seams: chart borders coincide and shading is continuous). No link crosses a line of
// atlas.contacts, where something stands on the surface, or a gap wider than two texels (a chart that folds
// back beside itself). None joins texels that no window could hold both of, because their sizes differ or
// their normals are more than twice 25 degrees apart: averages over links would give a sliver the noise of a
// wall. Takes about half a microsecond and 24 bytes a site. The same for any number of threads.
SurfaceLinks surface_links(SeamFinder& seams, const SiteGeometry& sites, unsigned threads);
SurfaceLinks surface_links(const Scene& scene, const Atlas& atlas, const SiteGeometry& sites,
                           unsigned threads);

}  // namespace kiln
