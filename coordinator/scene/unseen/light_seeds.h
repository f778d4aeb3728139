// Places that make what they see seen: cameras, lamps, surfaces that shine.
#pragma once

#include <vector>

#include "coordinator/scene/density/wishes.h"
#include "coordinator/scene/unseen/solid.h"

namespace kiln {

struct Seed {
  Vec3 position;
  bool camera;  // looks through the backs of single-sided surfaces, as engines draw them
};

struct Seeds {
  std::vector<Seed> places;
  bool sky = false;  // an environment or a sun: what leaves the scene has met it
  bool any(const Solid& solid, size_t instances) const;
};

// Of emissive surfaces at most kEmissivePlaces points.
Seeds find_seeds(const Scene& scene, const std::vector<Viewpoint>& cameras, const Solid& solid);
constexpr size_t kEmissivePlaces = 256;

}  // namespace kiln
