#include "tests/seams/baked_room.h"

#include "tests/analytic/scene_maker.h"
#include "tests/seams/pieces.h"

namespace kiln::test {

Scene room_scene() {
  SceneMaker maker;
  const uint32_t grey = maker.lambert(Vec3(0.6f));
  const uint32_t lamp = maker.lambert(Vec3(0.0f), Vec3(12.0f));
  maker.environment(Vec3(0.15f));
  Pieces pieces = wall_of_eight();
  Mesh cylinder = mantle(0.4f, 1.2f, 24, 1.0);
  pieces.add(cylinder, moved({2.2f, 0.02f, 1.2f}));
  pieces.add(bevelled_box(0.9f, 0.12f), moved({4.1f, 0.02f, 1.1f}));
  pieces.add(cube(0.9f), moved({5.9f, 0.02f, 1.2f}));
  Scene scene = maker.take();
  scene.meshes = pieces.scene.meshes;
  scene.instances = pieces.scene.instances;
  for (Instance& i : scene.instances) i.material = grey;
  SceneMaker rest;
  rest.scene() = std::move(scene);
  rest.quad({0, 0, 0}, {0, 0, 3}, {8, 0, 0}, grey);
  rest.quad({2.6f, 2.4f, 0.7f}, {0.8f, 0, 0}, {0, 0, 0.8f}, lamp);  // shines down
  return rest.take();
}

Bake baked_room(uint32_t samples, float texels_per_metre) {
  TransportSettings settings;
  settings.max_bounces = 8;
  return bake(room_scene(), texels_per_metre, samples, settings);
}

}  // namespace kiln::test
