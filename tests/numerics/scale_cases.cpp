#include <cstring>

#include "tests/numerics/cases.h"

namespace kiln::test {
namespace {

// A closed room with a lamp and a block. Coordinates are multiples of 1/8, which are floats 100 km away too.
Scene room(float scale) {
  SceneMaker m;
  const uint32_t wall = m.lambert(Vec3(0.6f)), lamp = m.lambert(Vec3(0.0f), Vec3(10.0f));
  m.box(Vec3(0.0f), Vec3(2, 1.5f, 1) * scale, true, wall);
  m.box(Vec3(0.25f, 0, 0.25f) * scale, Vec3(0.75f, 0.5f, 0.75f) * scale, false, wall);
  m.quad(Vec3(0.75f, 1.375f, 0.25f) * scale, Vec3(0.5f, 0, 0) * scale, Vec3(0, 0, 0.5f) * scale, lamp);
  return m.take();
}

// 5.9 texels a metre: no wall ends on the edge of a texel, where rounding would add one.
Bake bake_room(Scene scene, double scale) {
  return bake(std::move(scene), static_cast<float>(5.9 / scale), 256);
}
const Bake& plain_room() {
  static const Bake b = bake_room(room(1), 1);
  return b;
}

Measured ratio(const Bake& b, double error) {
  return {1, mean_e(b).value / mean_e(plain_room()).value, error};
}

// Texels of which a bit of E differs.
Measured different(const Bake& b) {
  const Bake& a = plain_room();
  double count = std::abs(static_cast<double>(a.texels.size()) - static_cast<double>(b.texels.size()));
  for (size_t i = 0; i < std::min(a.texels.size(), b.texels.size()); ++i)
    count += std::memcmp(&a.texels[i].e, &b.texels[i].e, sizeof(Vec3)) != 0;
  return {0, count, 0};
}

Scene moved_by_transform(const Vec3& by) {
  Scene s = room(1);
  for (Instance& i : s.instances) i.to_world[3] = by;
  return s;
}
Scene moved_by_vertices(const Vec3& by) {
  Scene s = room(1);
  for (Mesh& m : s.meshes)
    for (Vec3& p : m.positions) p += by;
  return s;
}

}  // namespace

void add_scale_cases(std::vector<Case>& cases) {
  for (const double scale : {1e-4, 1e5})
    cases.push_back({scale < 1 ? "a room of 0.2 mm" : "a room of 200 km",
                     "mean E over that of the same room of 2 m, same samples; goal 0.1 %",
                     [scale] { return ratio(bake_room(room(static_cast<float>(scale)), scale), 1e-3); }});
  for (const int power : {-13, 17})
    cases.push_back({power < 0 ? "the room, 2^-13 as large" : "the room, 2^17 as large",
                     "texels of which a bit of E differs from the room of 2 m", [power] {
                       const double scale = std::ldexp(1.0, power);
                       return different(bake_room(room(static_cast<float>(scale)), scale));
                     }});
  const Vec3 far(1e5f, -1e5f, 1e5f);
  cases.push_back({"the room 100 km away, by its nodes", "mean E over that at the origin; goal 0.1 %",
                   [far] { return ratio(bake_room(moved_by_transform(far), 1), 1e-3); }});
  cases.push_back({"the room 100 km away, in its vertices", "mean E over that at the origin; goal 0.1 %",
                   [far] { return ratio(bake_room(moved_by_vertices(far), 1), 1e-3); }});
  cases.push_back(
      {"the room 100 km away, a pebble at the origin",
       "mean E over that without; goal 0.1 %, which single precision does not give: the scene cannot "
       "be moved back, and rays begin 2^-17 of its reach, 0.76 m, off the walls",
       [far] {
         Scene s = moved_by_transform(far);
         SceneMaker pebble;
         pebble.quad(Vec3(-0.1f), {0, 0, 0.1f}, {0.1f, 0, 0});
         s.meshes.push_back(pebble.scene().meshes[0]);
         Instance i = pebble.scene().instances[0];
         i.mesh = static_cast<uint32_t>(s.meshes.size() - 1);
         s.instances.push_back(i);
         const Bake b = bake_room(s, 1);
         double sum = 0, weights = 0;
         for (const BakedTexel& t : b.texels)
           if (t.instance + 1 != s.instances.size()) sum += t.coverage * t.luminance, weights += t.coverage;
         return Measured{1, sum / weights / mean_e(plain_room()).value, 1e-3};
       },
       true});
}

}  // namespace kiln::test
