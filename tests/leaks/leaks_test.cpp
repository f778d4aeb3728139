// Light where there is none. A closed room holds no light at all, so every value in it but 0 is wrong.
#include "tests/analytic/scene_maker.h"
#include "tests/leaks/leak_bake.h"

namespace kiln {
namespace {

using test::LeakBake;
using test::SceneMaker;

constexpr float kTexels = 4;  // per metre

// Two rooms of 4 x 2.5 x 4 m under one floor slab and one ceiling, parted by a wall at x = 0.13 m; a lamp in
// the left one. Nothing but the wall's thickness changes.
Scene two_rooms(float thickness) {
  SceneMaker m;
  const uint32_t white = m.lambert(Vec3(0.7f));
  m.box({-5, -0.3f, -3}, {5, 0, 3}, false, white);    // floor
  m.box({-5, 2.5f, -3}, {5, 2.8f, 3}, false, white);  // ceiling
  m.box({-4.3f, 0, -2.3f}, {-4, 2.5f, 2.3f}, false, white);
  m.box({4, 0, -2.3f}, {4.3f, 2.5f, 2.3f}, false, white);
  m.box({-4, 0, -2.3f}, {4, 2.5f, -2}, false, white);
  m.box({-4, 0, 2}, {4, 2.5f, 2.3f}, false, white);
  m.box({0.13f, 0, -2}, {0.13f + thickness, 2.5f, 2}, false, white);
  m.point({-2, 1.5f, 0.4f}, Vec3(10.0f));
  return m.take();
}

struct Leak {
  double worst = 0;      // E in the dark room
  double lit = 0;        // mean E of the lit room
  double worst_lit = 0;  // least E in the lit room, within half a texel of the wall
};
Leak measure(const LeakBake& b, float wall, float thickness) {
  Leak leak;
  double sum = 0, count = 0;
  leak.worst_lit = 1e9;
  test::for_each_point(b, 240, [&](const Vec3& p, const Vec3& n, double e) {
    const Vec3 off = p + 1e-4f * n;
    if (std::abs(off.z) >= 2 || off.y <= 0 || off.y >= 2.5f || std::abs(off.x) >= 4) return;
    if (off.x > wall + thickness) leak.worst = std::max(leak.worst, e);
    if (off.x < wall) {
      sum += e, count += 1;
      if (off.x > wall - 0.5f / kTexels) leak.worst_lit = std::min(leak.worst_lit, e);
    }
  });
  leak.lit = sum / count;
  return leak;
}

Leak bake_rooms(float thickness, bool cut) {
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = kTexels;
  a.cut_contacts = cut;
  return measure(test::bake_map(two_rooms(thickness), a, 64), 0.13f, thickness);
}

TEST(Leaks, ADarkRoomBesideALitOneStaysDark) {
  for (const float thickness : {0.1f, 0.01f, 0.001f}) {
    const Leak before = bake_rooms(thickness, false), after = bake_rooms(thickness, true);
    std::printf("%g m: lit %.4g, in the dark %.4g -> %.4g, least beside the wall in the light %.4g -> %.4g\n",
                double{thickness}, after.lit, before.worst, after.worst, before.worst_lit, after.worst_lit);
    EXPECT_LT(after.worst, 0.001 * after.lit) << thickness;
  }
}

}  // namespace
}  // namespace kiln
