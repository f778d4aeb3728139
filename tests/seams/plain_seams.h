// Seams found the slow way, to hold the product against: every side of every face beside every other.
#pragma once

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln::test {

struct PlainPoint {
  DVec3 world;
  DVec2 texel[2];
  uint32_t page[2], instance[2];
};

// `count` places spread evenly over the length of all seams: sides that lie on each other to `tolerance`
// metres, with faces on opposite sides, shading normals within `degrees`, and other texels on either side.
std::vector<PlainPoint> plain_seam_points(const Scene& scene, const Atlas& atlas, size_t count,
                                          double degrees = 5, double tolerance = 1e-4);

// Those whose first side is of instances [first, last].
std::vector<PlainPoint> of_pieces(const std::vector<PlainPoint>& points, uint32_t first, uint32_t last);

// What a bilinear lookup gives, texels that are not set left out as the previews do.
double bilinear(const Atlas& atlas, const Lightmap& map, size_t plane, uint32_t page, const DVec2& at);

struct PlainSteps {
  double largest = 0, rms = 0;
};
// |difference| of luminance between both sides relative to their mean.
PlainSteps plain_steps(const Atlas& atlas, const Lightmap& map, const std::vector<PlainPoint>& points);

}  // namespace kiln::test
