// Scenes whose unit is hardly the metre.
#pragma once

#include <string>

#include "common/scene/scene.h"

namespace kiln {

struct SceneScale {
  double widest_m = 0;  // longest side of the bounding box
  double area_m2 = 0;   // of all triangles, wherever they stand
};
SceneScale measure_scale(const Scene& scene);

// For a scene of hundreds of metres: "the scene is 560 m wide; if it is 5.6 m in centimetres, scale it by
// 0.01 ...", for one of millimetres likewise; empty for others.
std::string doubt_unit(const SceneScale& scale);

// The same with the density that fits, where layout pack at `texels_per_metre` would make millions of texels
// of a scene so large, or of one so small next to none; empty otherwise.
std::string doubt_density(const SceneScale& scale, double texels_per_metre);

}  // namespace kiln
