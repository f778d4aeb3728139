// The factor on texels per metre of each object.
#pragma once

#include <string>
#include <vector>

#include "common/job/settings.h"
#include "common/scene/scene.h"
#include "coordinator/scene/density/wishes.h"

namespace kiln {

struct DensityFactors {
  std::vector<float> by_instance;  // for AtlasSettings::density; empty where all are 1
  std::vector<std::string> notes;  // requests that could not be met, one sentence each
};

// The product of four factors, each 1 by default, clamped to kMin- and kMaxDensityFactor:
// - the file's factors of node, mesh and material;
// - boxes of the file and of the settings: a box above 1 applies to every object with a triangle that touches
//   it, a box below 1 to every object wholly inside; of several, the largest applies;
// - cameras (importance_cameras): camera_distance / distance beyond that distance, at least 1/16, which keeps
//   the number of texels per pixel. The distance is to the nearest point of the object's bounds, and the
//   camera with the largest factor counts; outside a camera's view its factor is times unseen_density;
// - size (small_objects): the diagonal of the object's bounds over that length, at least 1/16.
// The last two are rounded together to powers of 2^(1/4), so that equal objects at nearly equal distances
// share their charts' masks; factors given as numbers are not rounded. Bounds are those of the triangles in
// world space.
DensityFactors density_factors(const Scene& scene, const DensityWishes& wishes, const BakeSettings& settings);

// Upper bound on every object's factor, for use before instances exist.
double most_density_factor(const DensityWishes& wishes, const BakeSettings& settings);

}  // namespace kiln
