// Light where there is none. A closed place holds no light at all, so every value in it but 0 is wrong.
#include "tests/leaks/leak_bake.h"
#include "tests/leaks/leak_scenes.h"

namespace kiln {
namespace {

using test::LeakBake;
using test::LeakScene;

constexpr float kTexels = 4;  // per metre
constexpr uint32_t kSamples = 64;

struct Leak {
  double worst = 0;      // E in the dark place
  double lit = 0;        // mean E elsewhere on surfaces that face upwards at the floor's height
  double worst_lit = 0;  // least E of the lit room within half a texel of its wall
};

Leak measure(const LeakScene& scene, const LeakBake& b) {
  Leak leak;
  double sum = 0, count = 0;
  leak.worst_lit = 1e9;
  test::for_each_point(b, 240, [&](const Vec3& p, const Vec3& n, double e) {
    const Vec3 off = p + 1e-4f * n;
    bool dark = true;
    for (int axis = 0; axis < 3; ++axis) dark &= off[axis] > scene.low[axis] && off[axis] < scene.high[axis];
    if (dark) leak.worst = std::max(leak.worst, e);
    if (dark || p.y != 0 || n.y < 0.9f || e == 0) return;
    sum += e, count += 1;
    if (p.x < test::kWallX && p.x > test::kWallX - 0.5f / kTexels && std::abs(p.z) < 2)
      leak.worst_lit = std::min(leak.worst_lit, e);
  });
  leak.lit = sum / count;
  return leak;
}

struct BeforeAfter {
  Leak before, after;
};
BeforeAfter bake_both(const char* name, LeakScene scene) {
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = kTexels;
  BeforeAfter both;
  a.cut_contacts = false;
  both.before = measure(scene, test::bake_map(scene.maker.scene(), a, kSamples));
  a.cut_contacts = true;
  both.after = measure(scene, test::bake_map(scene.maker.scene(), a, kSamples));
  const auto percent = [](const Leak& l) { return 100 * l.worst / l.lit; };
  std::printf("| %s | %.3g %% | %.3g %% |\n", name, percent(both.before), percent(both.after));
  EXPECT_GT(both.before.worst, 0.001 * both.before.lit) << name;  // else the scene shows nothing
  EXPECT_LT(both.after.worst, 0.001 * both.after.lit) << name;
  return both;
}

TEST(Leaks, ADarkRoomBesideALitOneStaysDark) {
  for (const auto& [name, thickness] :
       {std::pair("wall of 10 cm", 0.1f), {"wall of 1 cm", 0.01f}, {"wall of 1 mm", 0.001f}}) {
    const BeforeAfter both = bake_both(name, test::two_rooms(thickness));
    // Nor does the dark side darken the lit one: E there falls by a fifth over the distance at most.
    EXPECT_GT(both.after.worst_lit, 1.25 * both.before.worst_lit) << name;
  }
}

TEST(Leaks, UnderATableWithClosedSides) {
  bake_both("under a table", test::closed_table());
}
TEST(Leaks, BetweenStackedCrates) {
  bake_both("between crates", test::stacked_crates());
}
TEST(Leaks, BehindACurtain) {
  bake_both("behind a curtain", test::curtain());
}

}  // namespace
}  // namespace kiln
