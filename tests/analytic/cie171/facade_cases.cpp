// 5.11 to 5.14: daylight in a black room through an opening in an endless facade, from the overcast sky
// (1 + 2 sin) / 3, the ground outside and masks.
#include "tests/analytic/cie171/cases.h"
#include "tests/analytic/cie171/glass.h"
#include "tests/analytic/cie171/skies.h"

namespace kiln::test {
namespace {

// The facade is the plane x = 0, 3 m high, with the sky above it. The room: x in [-3, 0], y in [0, 3], z in
// [-2, 2]. The opening: y in [0.75, 2.75], z in [-1.75, 1.75]. "Endless" is kFar to either side.
constexpr double kTop = 3, kSill = 0.75, kHead = 2.75, kHalf = 1.75;
constexpr float kFar = 150;
constexpr double kOverhang = 1.5;                                 // 5.13: depth of the mask at kTop
constexpr double kOpposite = 6, kWallTop = 5, kWallAlbedo = 0.5;  // 5.14: the mask's x, height and albedo
constexpr double kGroundAlbedo = 0.3;

enum Receiver : uint32_t { kFloor, kBackWall, kCeiling };
enum class Mask { kNone, kHorizontal, kVertical };
struct Facade {
  Receiver receiver;
  Mask mask = Mask::kNone;
  bool glazed = false;
  uint32_t samples;
};

// Horizontal irradiance of the ground at distance x from the facade. With the profile angle a around z and
// s = d.z the solid angle is ds da, so that E = 1/3 int (pi/2 sin a + 8/3 sin^2 a) da up to the facade's or
// the mask's edge.
double ground_irradiance(const Facade& c, double x) {
  const double a = c.mask == Mask::kHorizontal ? std::atan2(kTop, kOverhang - x) : std::atan2(kTop, -x);
  return (M_PI / 2 * (1 - std::cos(a)) + 4.0 / 3 * (a - 0.5 * std::sin(2 * a))) / 3;
}
// Irradiance at height y of the wall opposite, above the facade's edge: the same with the cosine of a.
double opposite_irradiance(double y) {
  const double s = std::max(0.0, std::sin(std::atan2(kTop - y, kOpposite)));
  return (M_PI / 2 * (1 - s) + 4.0 / 3 * (1 - s * s)) / 3;
}

// Radiance that arrives at p from a unit direction w through the opening.
double outside(const Facade& c, const DVec3& p, const DVec3& w) {
  if (c.mask == Mask::kVertical) {
    const double y = p.y + w.y / w.x * (kOpposite - p.x);
    if (y < 0) return 0;
    if (y < kWallTop) return kWallAlbedo * opposite_irradiance(y) / M_PI;
  }
  if (c.mask == Mask::kHorizontal && p.y + w.y / w.x * (kOverhang - p.x) > kTop) return 0;
  if (w.y > 0) return (1 + 2 * w.y) / 3;
  return kGroundAlbedo * ground_irradiance(c, p.x - w.x / w.y * p.y) / M_PI;
}

// Heights of the opening between which the integrand is smooth.
std::vector<double> pieces(const Facade& c, const DVec3& p) {
  const auto crossing = [&](double x, double y) { return p.y + (y - p.y) * -p.x / (x - p.x); };
  std::vector<double> at = {kSill, kHead, p.y};
  if (c.mask == Mask::kHorizontal) at.push_back(crossing(kOverhang, kTop));
  if (c.mask == Mask::kVertical)
    for (const double y : {0.0, kTop, kWallTop}) at.push_back(crossing(kOpposite, y));
  for (double& y : at) y = std::clamp(y, kSill, kHead);
  std::sort(at.begin(), at.end());
  return at;
}

double through_facade(const Facade& c, const Vec3& point, const Vec3& n) {
  const DVec3 p(point);
  const std::vector<double> at = pieces(c, p);
  double sum = 0;
  for (size_t i = 1; i < at.size(); ++i)
    if (at[i] > at[i - 1])
      sum += integrate(at[i - 1], at[i], [&](double y) {
        return integrate(-kHalf, kHalf, [&](double z) {
          const DVec3 d = DVec3(0, y, z) - p;
          const double d2 = glm::dot(d, d);
          const DVec3 w = d / std::sqrt(d2);
          const double pane = c.glazed ? through_pane(w.x) : 1.0;
          return outside(c, p, w) * pane * std::max(0.0, glm::dot(w, DVec3(n))) * w.x / d2;
        });
      });
  return sum;
}

void add_building(SceneMaker& m, uint32_t black) {
  m.quad({-3, 0, -2}, {0, 0, 4}, {3, 0, 0}, black);  // floor, faces up
  m.quad({-3, 0, -2}, {0, 3, 0}, {0, 0, 4}, black);  // back wall, faces +x
  m.quad({-3, 3, -2}, {3, 0, 0}, {0, 0, 4}, black);  // ceiling, faces down
  m.quad({-3, 0, -2}, {3, 0, 0}, {0, 3, 0}, black).quad({-3, 0, 2}, {3, 0, 0}, {0, 3, 0}, black);
  m.quad({0, 0, -kFar}, {0, 3, 0}, {0, 0, kFar - 1.75f}, black);
  m.quad({0, 0, 1.75f}, {0, 3, 0}, {0, 0, kFar - 1.75f}, black);
  m.quad({0, 0, -1.75f}, {0, 0.75f, 0}, {0, 0, 3.5f}, black);
  m.quad({0, 2.75f, -1.75f}, {0, 0.25f, 0}, {0, 0, 3.5f}, black);
}

Outcome facade(const Facade& c) {
  SceneMaker m;
  const uint32_t black = m.lambert(Vec3(0.0f), Vec3(0.0f), true);
  add_building(m, black);
  // Beyond the ground's far edge the image goes on with its radiance.
  double below = kGroundAlbedo * 7 / 9;
  if (c.mask == Mask::kVertical) {
    below = 0;
    m.quad({0, 0, -kFar}, {0, 0, 2 * kFar}, {6, 0, 0}, black);
    const uint32_t grey = m.lambert(Vec3(static_cast<float>(kWallAlbedo)), Vec3(0.0f), true);
    m.quad({6, 0, -kFar}, {0, 0, 2 * kFar}, {0, 5, 0}, grey);
  } else {
    m.quad({0, 0, -kFar}, {0, 0, 2 * kFar}, {kFar, 0, 0}, m.lambert(Vec3(static_cast<float>(kGroundAlbedo))));
  }
  if (c.mask == Mask::kHorizontal) m.quad({0, 3, -kFar}, {1.5f, 0, 0}, {0, 0, 2 * kFar}, black);
  if (c.glazed) m.box({0.01f, 0.25f, -2.5f}, {0.016f, 2.95f, 2.75f}, false, add_clear_glass(m));
  add_sky(m, 16, DVec3(0, 1, 0), below);
  Scene scene = m.take();
  receive_only(scene, {c.receiver});
  TransportSettings settings;
  settings.max_bounces = 1;  // the ground does not see the pane's mirror image of the sky
  return compare_with(bake(std::move(scene), 2, c.samples, settings), c.receiver,
                      [&](const Vec3& p, const Vec3& n) { return through_facade(c, p, n); });
}

}  // namespace

void add_facade_cases(std::vector<CieCase>& cases) {
  const auto add = [&](const char* section, const std::string& name, const Facade& c) {
    cases.push_back({section, name, "quadrature over the opening", [c] { return facade(c); }});
  };
  add("5.11", "facade opening, floor", {kFloor, Mask::kNone, false, 65536});
  add("5.11", "facade opening, back wall", {kBackWall, Mask::kNone, false, 65536});
  add("5.11", "facade opening, ceiling", {kCeiling, Mask::kNone, false, 65536});
  add("5.12", "glazed facade opening, floor", {kFloor, Mask::kNone, true, 65536});
  add("5.12", "glazed facade opening, back wall", {kBackWall, Mask::kNone, true, 65536});
  add("5.12", "glazed facade opening, ceiling", {kCeiling, Mask::kNone, true, 81920});
  add("5.13", "horizontal mask of 1.5 m, floor", {kFloor, Mask::kHorizontal, false, 131072});
  add("5.13", "horizontal mask of 1.5 m, back wall", {kBackWall, Mask::kHorizontal, false, 65536});
  add("5.14", "wall opposite of 5 m, floor", {kFloor, Mask::kVertical, false, 65536});
  add("5.14", "wall opposite of 5 m, back wall", {kBackWall, Mask::kVertical, false, 114688});
}

}  // namespace kiln::test
