// The graph of texel sites that lie beside each other on a surface.
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

// Links the four neighbours of a texel that are of the same chart, and across seams (coordinator/bake/seams:
// the borders of two charts lie on each other and shading goes on) the texels on either side. No link crosses
// a line of atlas.contacts, where something stands on the surface, nor a gap wider than two texels (a chart
// that comes back beside itself). About half a microsecond a site, and 24 bytes.
// The same for any number of threads.
SurfaceLinks surface_links(SeamFinder& seams, const SiteGeometry& sites, unsigned threads);
SurfaceLinks surface_links(const Scene& scene, const Atlas& atlas, const SiteGeometry& sites,
                           unsigned threads);

}  // namespace kiln
