// Scenes with a closed place that no light reaches.
#pragma once

#include "tests/analytic/scene_maker.h"

namespace kiln::test {

struct LeakScene {
  SceneMaker maker;
  Vec3 low, high;  // the dark place
};

// Two rooms of 4 x 2.5 x 4 m under one floor slab and one ceiling, parted by a wall that begins at kWallX; a
// lamp in the left one. Nothing but the wall's thickness changes.
constexpr float kWallX = 0.13f;
LeakScene two_rooms(float thickness);
// Sun and sky over a floor; a table with sides of 1 cm down to it.
LeakScene closed_table();
// Four crates around a shaft, and one that lies on them.
LeakScene stacked_crates();
// A curtain without thickness that touches the wall at its sides and above. It and the wall reach a little
// into the floor: between surfaces that only just touch a ray in some ten thousands slips through. Dark are
// wall and floor: the cloth itself has one value for both its sides.
LeakScene curtain();

}  // namespace kiln::test
