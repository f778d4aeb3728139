// Points from which visibility spreads: cameras, lamps, emissive surfaces.
#pragma once

#include <vector>

#include "coordinator/scene/density/wishes.h"
#include "coordinator/scene/sight/solid.h"

namespace kiln {

struct Seed {
  Vec3 position;
  bool camera;  // sees through the backs of single-sided surfaces, as engines draw them
};

struct Seeds {
  std::vector<Seed> places;
  bool sky = false;  // an environment or a sun: reached by any ray that leaves the scene
  bool any(const Solid& solid, size_t instances) const;
};

// At most kEmissivePlaces points on emissive surfaces.
Seeds find_seeds(const Scene& scene, const std::vector<Viewpoint>& cameras, const Solid& solid);
constexpr size_t kEmissivePlaces = 256;

}  // namespace kiln
