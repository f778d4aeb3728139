// Moves scenes far from the origin to where floats are fine.
#pragma once

#include "common/scene/scene.h"

namespace kiln {

// Rays, their offsets and Embree use single precision, whose steps grow with the distance from the
// origin: 8 mm at 100 km. A bake's results must not depend on where the scene is. So each axis
// along which the scene occupies one far stretch [low, high], with 0 < low and high <= 2 low in
// magnitude, is moved to put the middle of the stretch at the origin, but only if that rounds no
// instance, vertex or light (by Sterbenz' lemma it rounds none within the stretch): the scene stays
// exactly the same. Returns the offset subtracted.
Vec3 recentre(Scene& scene);

}  // namespace kiln
