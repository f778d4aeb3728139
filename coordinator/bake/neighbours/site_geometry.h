// World-space geometry of texel sites.
#pragma once

#include <array>
#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

// By site: means over the texel's valid points, all of which lie on surfaces.
struct SiteGeometry {
  std::vector<Vec3> position;       // world, metres
  std::vector<Vec3> normal;         // unit, shading; 0 where the points' normals cancel
  std::vector<float> texel_size;    // metres per texel here; 0 where the face has no area in the atlas
  std::vector<uint32_t> placement;  // chart that most points lie on (the first of a tie)
  std::vector<std::array<uint32_t, 2>> texel;  // column and row on its page
  size_t size() const { return position.size(); }
};

SiteGeometry site_geometry(const Scene& scene, const Atlas& atlas, unsigned threads);

// One of the texel's valid points, picked by a number in [0, 1) as pick_site does; world, geometric normal.
struct SitePoint {
  DVec3 position, normal;
};
SitePoint point_on_site(const Scene& scene, const Atlas& atlas, uint32_t site, float number);

}  // namespace kiln
