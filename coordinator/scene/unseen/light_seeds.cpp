#include "coordinator/scene/unseen/light_seeds.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

bool is_lamp(const Record& light) {
  return light.type == "point" || light.type == "spot" || light.type == "ies";
}
bool is_sheet(const Record& light) {
  return light.type == "rectangle" || light.type == "disc";
}

// The centre and four points of the rim, off the plane on the sides that shine: a lamp may lie on a ceiling.
void add_sheet(const Record& light, std::vector<Seed>& places) {
  const Property* radius = light.find("radius");
  const std::vector<double> size =
      radius ? std::vector<double>(2, std::sqrt(2.0) * radius->numbers.at(0)) : light.find("size")->numbers;
  const Mat4x3& m = light.to_world;
  const Vec3 x = m[0] * static_cast<float>(0.5 * size.at(0)), y = m[1] * static_cast<float>(0.5 * size.at(1));
  const Vec3 off = m[2] * (1e-3f * (length(x) + length(y)));
  const bool two_sided = light.find("sides")->numbers.at(0) == 2;
  for (const float side : {-1.0f, 1.0f}) {
    if (side > 0.0f && !two_sided) continue;
    places.push_back({m[3] + off * side, false});
    for (const Vec2& s : {Vec2(-1, -1), Vec2(1, -1), Vec2(1, 1), Vec2(-1, 1)})
      places.push_back({m[3] + x * s.x + y * s.y + off * side, false});
  }
}

}  // namespace

bool Seeds::any(const Solid& solid, size_t instances) const {
  if (sky || !places.empty()) return true;
  for (uint32_t i = 0; i < instances; ++i)
    if (solid.emits(i)) return true;
  return false;
}

Seeds find_seeds(const Scene& scene, const std::vector<Viewpoint>& cameras, const Solid& solid) {
  Seeds seeds;
  for (const Viewpoint& camera : cameras) seeds.places.push_back({camera.to_world[3], true});
  for (const Record& light : scene.lights) {
    if (is_lamp(light)) seeds.places.push_back({light.to_world[3], false});
    if (is_sheet(light)) add_sheet(light, seeds.places);
    seeds.sky |= !is_lamp(light) && !is_sheet(light);
  }
  size_t triangles = 0, at = 0;
  for (uint32_t i = 0; i < scene.instances.size(); ++i)
    if (solid.emits(i)) triangles += scene.meshes[scene.instances[i].mesh].triangles.size();
  const size_t step = triangles / kEmissivePlaces + 1;
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    if (!solid.emits(i)) continue;
    const Mat4x3& to_world = scene.instances[i].to_world;
    const Mesh& mesh = scene.meshes[scene.instances[i].mesh];
    for (const UVec3& t : mesh.triangles) {
      if (at++ % step) continue;
      const Vec3 c[3] = {mesh.positions[t.x], mesh.positions[t.y], mesh.positions[t.z]};
      const Vec3 middle = transform_point(to_world, (c[0] + c[1] + c[2]) / 3.0f);
      const Vec3 extent = transform_vector(to_world, c[1] - c[0]);
      seeds.places.push_back({middle + 1e-3f * length(extent) * front_normal(to_world, c), false});
    }
  }
  return seeds;
}

}  // namespace kiln
