// How much denser or coarser the texels of each object are than the scene's texels per metre.
#pragma once

#include <string>
#include <vector>

#include "common/job/settings.h"
#include "common/scene/scene.h"
#include "coordinator/scene/density/wishes.h"

namespace kiln {

struct DensityFactors {
  std::vector<float> by_instance;  // for AtlasSettings::density; empty where all are 1
  std::vector<std::string> notes;  // what could not be as wished, one sentence each
};

// The product of four, each 1 where nothing is said, within kMin- and kMaxDensityFactor:
//   what the file says of node, mesh and material;
//   boxes, of the file and of the settings: one above 1 raises every object of which a triangle touches it,
//   one
//     below 1 lowers every object that lies wholly inside. Of several that apply the largest counts;
//   cameras (importance_cameras): camera_distance / distance beyond that distance, which keeps the texels
//   that
//     a pixel sees, but 1/16 or more; the distance is that to the nearest point of the object's bounds, and
//     of several cameras the one that asks for most counts. Outside a camera's view it asks for
//     unseen_density of that;
//   size (small_objects): the diagonal of the object's bounds over that length, but 1/16 or more.
// The last two are rounded to powers of 2^(1/4) together, so that equal objects at nearly equal distances
// share their charts' masks; what was said in numbers is taken as said. Bounds are of the triangles in the
// world.
DensityFactors density_factors(const Scene& scene, const DensityWishes& wishes, const BakeSettings& settings);

// No object's factor is above this: for whoever must know before there are instances to look at.
double most_density_factor(const DensityWishes& wishes, const BakeSettings& settings);

}  // namespace kiln
