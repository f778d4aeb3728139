// The scene whose atlas is fuzzed: two quads and a box.
#pragma once

#include "tests/analytic/scene_maker.h"

namespace kiln::fuzz {

inline Scene atlas_scene() {
  test::SceneMaker maker;
  maker.lambert(Vec3(0.5f));
  return maker.quad(Vec3(0), Vec3(1, 0, 0), Vec3(0, 1, 0))
      .quad(Vec3(0, 0, 1), Vec3(2, 0, 0), Vec3(0, 1, 0))
      .box(Vec3(3), Vec3(4), false)
      .take();
}

}  // namespace kiln::fuzz
