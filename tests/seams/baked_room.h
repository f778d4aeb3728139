#pragma once

#include "tests/analytic/in_process.h"

namespace kiln::test {

// A wall of eight panels behind a floor, with a cylinder, a bevelled box and a cube on it, under an emissive
// square near the wall and a dim sky, all grey; fixed samples, so there is noise. Instances 0 to 7: the wall.
enum RoomPiece : uint32_t { kCylinder = 8, kBevelledBox = 9, kCube = 10, kFloor = 11, kLamp = 12 };
Scene room_scene();
Bake baked_room(uint32_t samples, float texels_per_metre = 8);

}  // namespace kiln::test
