// Where texel sites are in the world.
#pragma once

#include <array>
#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

// By site; the mean of the texel's valid points, which all lie on surfaces.
struct SiteGeometry {
  std::vector<Vec3> position;       // world, metres
  std::vector<Vec3> normal;         // unit, shading; 0 where the points' normals cancel
  std::vector<float> texel_size;    // metres a texel measures here; 0 where its face has no area in the atlas
  std::vector<uint32_t> placement;  // of the chart that most points are of (of equals the first)
  std::vector<std::array<uint32_t, 2>> texel;  // column and row on its page
  size_t size() const { return position.size(); }
};

SiteGeometry site_geometry(const Scene& scene, const Atlas& atlas, unsigned threads);

}  // namespace kiln
