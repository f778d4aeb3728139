// 5.6 to 5.8: light that diffuse surfaces reflect.
#include "tests/analytic/cie171/cases.h"

namespace kiln::test {
namespace {

// A reflecting square S2 on the ground, x in [0.5, 0.5 + side], z centred, under a sun in the plane x = 0
// that neither the wall (x = 0) nor the ceiling (y = 2) receives or hides.
constexpr double kAlbedo = 0.8, kNear = 0.5, kHeight = 2;
constexpr double kScreen = 1.5, kScreenHeight = 0.8;  // 5.7: an endless black screen at this x, along the sun
enum Receiver : uint32_t { kWall, kCeiling };

struct Reflection {
  Receiver receiver;
  double side;  // of S2, metres
  bool screen;
  uint32_t samples;
};

// Irradiance of p from the part of S2 that it sees: its own side of the screen, and what lies beyond the
// line of sight over the screen's edge.
double from_square(const Reflection& c, const Vec3& p, const Vec3& n) {
  const double far = kNear + c.side, z = c.side / 2;
  const double radiance = kAlbedo * 1000 / std::sqrt(5) / M_PI;
  const auto strip = [&](double from, double to) {
    if (from >= to) return 0.0;
    return radiance * from_polygon(p, n, {{from, 0, -z}, {to, 0, -z}, {to, 0, z}, {from, 0, z}});
  };
  if (!c.screen) return strip(kNear, far);
  const bool is_before = p.x < kScreen;
  const double own = is_before ? strip(kNear, kScreen) : strip(kScreen, far);
  if (p.y <= kScreenHeight) return own;
  const double edge = (p.y * kScreen - kScreenHeight * p.x) / (p.y - kScreenHeight);
  return own + (is_before ? strip(edge, far) : strip(kNear, edge));
}

Outcome reflection(const Reflection& c) {
  SceneMaker m;
  m.lambert(Vec3(0.0f), Vec3(0.0f), true);
  const auto side = static_cast<float>(c.side);
  m.quad({0, 0, -1}, {0, kHeight, 0}, {0, 0, 2});  // faces +x
  m.quad({0, kHeight, -1}, {2, 0, 0}, {0, 0, 2});  // faces down
  m.quad({static_cast<float>(kNear), 0, -side / 2}, {0, 0, side}, {side, 0, 0}, m.lambert(Vec3(kAlbedo)));
  if (c.screen)
    m.quad({static_cast<float>(kScreen), 0, -30}, {0, static_cast<float>(kScreenHeight), 0}, {0, 0, 60});
  m.sun({0, 1, 2}, Vec3(1000.0f));
  Scene scene = m.take();
  receive_only(scene, {c.receiver});
  return compare_with(bake(std::move(scene), 5, c.samples), c.receiver,
                      [&](const Vec3& p, const Vec3& n) { return from_square(c, p, n); });
}

// All surfaces of a closed room of one albedo absorb what its lamp emits: the mean of E is flux / (area (1 -
// albedo)), wherever the lamp is.
Outcome room(double albedo) {
  SceneMaker m;
  m.lambert(Vec3(static_cast<float>(albedo)));
  m.box({0, 0, 0}, {4, 4, 4}, true).point({1.2f, 2.6f, 2.2f}, Vec3(100.0f));
  TransportSettings settings;
  settings.max_bounces = 100000;
  const Bake b = bake(m.take(), 2, 4096, settings);
  Outcome out{4 * M_PI * 100 / (96 * (1 - albedo)), 0, 0, 1};
  for (uint32_t wall = 0; wall < 6; ++wall) {
    const Outcome mean = compare_with(b, wall, [](const Vec3&, const Vec3&) { return 0.0; });
    out.measured += mean.measured / 6;
    out.error = std::hypot(out.error, mean.error / 6);
  }
  return out;
}

// A sphere of 1 m with the lamp in its centre. Its facets lie up to 2.7e-4 m inside the sphere.
Outcome sphere(double albedo) {
  SceneMaker m;
  m.lambert(Vec3(static_cast<float>(albedo)));
  m.sphere({0, 0, 0}, 1, 96, 0, true).point({0, 0, 0}, Vec3(100.0f));
  TransportSettings settings;
  settings.max_bounces = 100000;
  return compare_with(bake(m.take(), 4, 2048, settings), 0,
                      [&](const Vec3&, const Vec3&) { return 100 / (1 - albedo); });
}

}  // namespace

void add_reflection_cases(std::vector<CieCase>& cases) {
  const auto add = [&](const char* section, const char* name, const Reflection& r) {
    cases.push_back({section, name, r.screen ? "polygon formula of the visible part" : "polygon formula",
                     [r] { return reflection(r); }});
  };
  add("5.6", "square of 2 m, wall", {kWall, 2, false, 40960});
  add("5.6", "square of 2 m, ceiling", {kCeiling, 2, false, 32768});
  add("5.6", "square of 4 m, wall", {kWall, 4, false, 16384});
  add("5.6", "square of 4 m, ceiling", {kCeiling, 4, false, 8192});
  add("5.7", "square of 4 m with a screen, wall", {kWall, 4, true, 28672});
  add("5.7", "square of 4 m with a screen, ceiling", {kCeiling, 4, true, 10240});
  for (const double albedo : {0.5, 0.8})
    cases.push_back({"5.8", "sphere of albedo " + std::to_string(albedo).substr(0, 3),
                     "I / (r^2 (1 - albedo))", [albedo] { return sphere(albedo); }});
  for (const double albedo : {0.2, 0.5, 0.8, 0.9})
    cases.push_back({"5.8", "room of 4 x 4 x 4 m, albedo " + std::to_string(albedo).substr(0, 3),
                     "4 pi I / (S (1 - albedo))", [albedo] { return room(albedo); }});
}

}  // namespace kiln::test
