#include "tests/denoise/scenes.h"

#include "tests/analytic/scene_maker.h"

namespace kiln::test {

Scene lamp_room_scene() {
  SceneMaker m;
  const uint32_t white = m.lambert(Vec3(0.7f)), red = m.lambert(Vec3(0.7f, 0.1f, 0.1f)),
                 lamp = m.lambert(Vec3(0.0f), Vec3(20.0f));
  m.box({0, 0, 0}, {4, 3, 4}, true, white);
  m.box({0.8f, 0, 1}, {1.8f, 2, 2}, false, white);
  m.box({2.4f, 0, 2.2f}, {3.3f, 1, 3.1f}, false, red);
  m.quad({1.6f, 2.98f, 1.6f}, {0.8f, 0, 0}, {0, 0, 0.8f}, lamp);
  return m.take();
}

}  // namespace kiln::test
