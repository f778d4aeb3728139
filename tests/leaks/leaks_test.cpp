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

// A closed place under sun and sky: what of the surface lies in it, and how much light it holds.
struct Dark {
  Vec3 low, high;
  double worst = 0, lit = 0;
};
void measure(const LeakBake& b, Dark& dark) {
  double sum = 0, count = 0;
  test::for_each_point(b, 200, [&](const Vec3& p, const Vec3& n, double e) {
    const Vec3 off = p + 1e-4f * n;
    const bool inside = off.x > dark.low.x && off.y > dark.low.y && off.z > dark.low.z &&
                        off.x < dark.high.x && off.y < dark.high.y && off.z < dark.high.z;
    if (inside) dark.worst = std::max(dark.worst, e);
    if (!inside && p.y == 0 && n.y > 0.9f) sum += e, count += 1;
  });
  dark.lit = sum / count;
}

SceneMaker floor_in_the_sun() {
  SceneMaker m;
  const uint32_t white = m.lambert(Vec3(0.7f));
  m.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, white);
  m.environment(Vec3(1.0f)).sun({0.4f, 0.8f, 0.3f}, Vec3(6.0f), 0.5f);
  return m;
}

void expect_dark(const char* name, const SceneMaker& maker, Dark dark) {
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = kTexels;
  SceneMaker copy = maker;
  Dark before = dark, after = dark;
  a.cut_contacts = false;
  measure(test::bake_map(copy.scene(), a, 64), before);
  a.cut_contacts = true;
  measure(test::bake_map(copy.scene(), a, 64), after);
  std::printf("%s: lit %.4g, in the dark %.4g -> %.4g\n", name, after.lit, before.worst, after.worst);
  EXPECT_GT(before.worst, 0.001 * before.lit) << name;  // else the scene shows nothing
  EXPECT_LT(after.worst, 0.001 * after.lit) << name;
}

TEST(Leaks, UnderATableWithClosedSides) {
  SceneMaker m = floor_in_the_sun();
  m.box({-1.03f, 0.7f, -0.57f}, {1.11f, 0.74f, 0.83f}, false);  // the top; sides of 1 cm below it
  m.box({-1.03f, 0, -0.57f}, {-1.02f, 0.7f, 0.83f}, false);
  m.box({1.10f, 0, -0.57f}, {1.11f, 0.7f, 0.83f}, false);
  m.box({-1.02f, 0, -0.57f}, {1.10f, 0.7f, -0.56f}, false);
  m.box({-1.02f, 0, 0.82f}, {1.10f, 0.7f, 0.83f}, false);
  expect_dark("table", m, {{-1.02f, 0, -0.56f}, {1.10f, 0.7f, 0.82f}});
}

// Four crates around a shaft, and one that lies on them.
TEST(Leaks, BetweenStackedCrates) {
  SceneMaker m = floor_in_the_sun();
  m.box({-1.07f, 0, -1.33f}, {0.23f, 1, -0.33f}, false);
  m.box({0.23f, 0, -1.33f}, {1.23f, 1, 0.17f}, false);
  m.box({-0.27f, 0, 0.17f}, {1.23f, 1, 1.17f}, false);
  m.box({-1.27f, 0, -0.33f}, {-0.27f, 1, 1.17f}, false);
  m.box({-0.77f, 1, -0.83f}, {0.73f, 2, 0.67f}, false);
  expect_dark("crates", m, {{-0.27f, 0, -0.33f}, {0.23f, 1, 0.17f}});
}

// A curtain without thickness that touches the wall at its sides and above. It and the wall reach a little
// into the floor: between surfaces that only just touch a ray in some ten thousands slips through.
TEST(Leaks, BehindACurtain) {
  SceneMaker m = floor_in_the_sun();
  const uint32_t cloth = m.lambert(Vec3(0.5f), Vec3(0.0f), true);
  m.quad({-4, -0.05f, -1.9f}, {8, 0, 0}, {0, 3, 0});
  m.quad({-1.13f, -0.05f, -1.9f}, {0.3f, 0, 0.3f}, {0, 2.12f, 0}, cloth);
  m.quad({-0.83f, -0.05f, -1.6f}, {1.7f, 0, 0}, {0, 2.12f, 0}, cloth);
  m.quad({0.87f, -0.05f, -1.6f}, {0.3f, 0, -0.3f}, {0, 2.12f, 0}, cloth);
  m.quad({-1.13f, 2.07f, -1.9f}, {0, 0, 0.3f}, {2.3f, 0, 0}, cloth);  // the rail
  // Of wall and floor: the cloth itself has one value for both its sides.
  expect_dark("curtain", m, {{-0.82f, 0, -1.9f}, {0.86f, 2.07f, -1.61f}});
}

}  // namespace
}  // namespace kiln
