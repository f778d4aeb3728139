// Rooms of slabs with a thickness, lamps and sheets, for asking who can be seen.
#pragma once

#include "tests/atlas/shapes.h"

namespace kiln::test {

constexpr float kThick = 0.2f;

struct Box {
  Vec3 low, high;
  bool holds(const Vec3& p) const {
    return p.x > low.x && p.y > low.y && p.z > low.z && p.x < high.x && p.y < high.y && p.z < high.z;
  }
  Box grown(float by) const { return {low - Vec3(by), high + Vec3(by)}; }
};

class World {
 public:
  World() {
    Record material;
    material.type = "metallic_roughness";
    scene.materials.push_back(material);
    Property& sides = material.properties.emplace_back();
    sides.name = "double_sided";
    sides.numbers = {1};
    scene.materials.push_back(material);
  }
  void add(Mesh mesh, const std::string& name, const Vec3& origin, uint32_t material = 0) {
    scene.instances.push_back(instance(static_cast<uint32_t>(scene.meshes.size()), name, at(origin)));
    scene.instances.back().material = material;
    scene.meshes.push_back(std::move(mesh));
  }
  void solid(const Box& extent, const std::string& name, uint32_t material = 0) {
    add(box(extent.high - extent.low, Uv::kUnit), name, extent.low, material);
  }
  // Six slabs around a room, the ends of each inside others. `roof` off: it is open above.
  void room(const Box& inside, const std::string& name, bool roof = true, uint32_t material = 0) {
    for (int axis = 0; axis < 3; ++axis)
      for (int end = 0; end < 2; ++end) {
        if (axis == 1 && end == 1 && !roof) continue;
        Box slab = inside.grown(kThick / 2);
        slab.low[axis] = end ? inside.high[axis] : inside.low[axis] - kThick;
        slab.high[axis] = end ? inside.high[axis] + kThick : inside.low[axis];
        this->solid(slab, name, material);
      }
  }
  void light(const std::string& type, const Vec3& origin = Vec3(0.0f)) {
    Record& lamp = scene.lights.emplace_back();
    lamp.type = type;
    lamp.to_world = at(origin);
  }

  Scene scene;
};

inline const Box kRoom{Vec3(0.0f), Vec3(4, 3, 4)};

// Closed, with a crate and a lamp in it.
inline World lit_room() {
  World world;
  world.room(kRoom, "room");
  world.solid({Vec3(1, 0, 1), Vec3(2, 1, 2)}, "crate");
  world.light("point", Vec3(2, 2, 2));
  return world;
}

}  // namespace kiln::test
