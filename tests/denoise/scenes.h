// Scenes that denoisers find hard or easy.
#pragma once

#include "common/scene/scene.h"

namespace kiln::test {

// A closed room of 4 x 3 x 4 m with two boxes and a lamp under the ceiling.
Scene lamp_room_scene();

}  // namespace kiln::test
