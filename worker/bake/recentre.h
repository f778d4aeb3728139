// Scenes far from the origin: moved near it, where floats are fine.
#pragma once

#include "common/scene/scene.h"

namespace kiln {

// Rays, their offsets and Embree work with coordinates in single precision, whose steps grow with the
// distance from the origin: 8 mm at 100 km. What a bake stores does not depend on where the scene is. So each
// axis of which the scene holds one far stretch [low, high], 0 < low and high <= 2 low in magnitude, is moved
// to put the middle of the stretch at the origin; but only if no instance, vertex or light is rounded by that
// (by Sterbenz' lemma none within the stretch is): the scene stays the same one, exactly. Returns what was
// subtracted.
Vec3 recentre(Scene& scene);

}  // namespace kiln
