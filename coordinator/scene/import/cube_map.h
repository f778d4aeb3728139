// The cube images of EXT_lights_image_based as one latitude-longitude image.
#pragma once

#include <array>

#include "common/image/image.h"
#include "common/math/vec.h"

namespace kiln {

// One square face of linear RGB radiance, row 0 on top.
struct CubeFace {
  uint32_t size = 0;
  std::vector<Vec3> texels;
};

// An image of 4 x 2 face sizes in the mapping of scene.h. The faces are in the order +x -x +y -y +z -z,
// seen from inside. `rotation` is the unit quaternion (x, y, z, w) that turns the cube into the world.
Texture cube_to_equirectangular(const std::array<CubeFace, 6>& faces, const double (&rotation)[4]);

}  // namespace kiln
