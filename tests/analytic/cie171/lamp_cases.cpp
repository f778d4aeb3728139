// 5.2 to 5.4: point and area sources over black surfaces, and the flux that arrives in a closed room.
#include "tests/analytic/cie171/cases.h"
#include "tests/lights/light_scenes.h"

namespace kiln::test {
namespace {

constexpr float kDensity = 4;  // texels per metre
constexpr uint32_t kSamples = 4096;
const Vec3 kLamp(1.3f, 2.5f, 2.2f);

enum Receiver : uint32_t { kFloor, kWall };

// A floor of 4 x 4 m and a wall of 4 x 2 m at its edge x = 0, both black.
SceneMaker corner() {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  m.quad({0, 0, 0}, {0, 2, 0}, {0, 0, 4});
  return m;
}

double from_point(const Vec3& p, const Vec3& n, double intensity) {
  const DVec3 d = DVec3(kLamp) - DVec3(p);
  const double d2 = glm::dot(d, d);
  return intensity * std::max(0.0, glm::dot(d, DVec3(n))) / (d2 * std::sqrt(d2));
}

Outcome point_lamp(Receiver receiver) {
  SceneMaker m = corner().point(kLamp, Vec3(100.0f));
  return compare_with(bake(m.take(), kDensity, kSamples), receiver,
                      [](const Vec3& p, const Vec3& n) { return from_point(p, n, 100); });
}

// A luminaire that hangs down; candela of a type C table with two vertical angles, 0 and 90 degrees, and the
// horizontal ones 0, 90, 180, 270 and 360.
constexpr double kNadir = 120;
constexpr double kAround[5] = {30, 90, 50, 10, 30};

double profile(const Vec3& p) {
  const DVec3 d = DVec3(p) - DVec3(kLamp);
  const double vertical = std::atan2(std::hypot(d.x, d.z), -d.y) / (M_PI / 2);
  if (vertical > 1) return 0;
  double quarters = std::atan2(-d.z, d.x) / (M_PI / 2);
  if (quarters < 0) quarters += 4;
  const int k = std::min(3, static_cast<int>(quarters));
  const double side = kAround[k] + (kAround[k + 1] - kAround[k]) * (quarters - k);
  return kNadir + (side - kNadir) * vertical;
}

Outcome luminaire(Receiver receiver) {
  SceneMaker m = corner();
  std::vector<float> candela;
  for (const double side : kAround) {
    candela.push_back(static_cast<float>(kNadir));
    candela.push_back(static_cast<float>(side));
  }
  add_ies(m.scene(), kLamp, {0, 90}, {0, 90, 180, 270, 360}, candela);
  Mat4x3& to_world = m.scene().lights[0].to_world;
  to_world = Mat4x3(Vec3(1, 0, 0), Vec3(0, 0, -1), Vec3(0, 1, 0), kLamp);  // its -z points down
  return compare_with(bake(m.take(), kDensity, kSamples), receiver,
                      [](const Vec3& p, const Vec3& n) { return from_point(p, n, profile(p)); });
}

const std::vector<DVec3> kPanel = {{1, 3, 1.5}, {2.5, 3, 1.5}, {2.5, 3, 2.5}, {1, 3, 2.5}};

Outcome panel(Receiver receiver, bool emissive) {
  SceneMaker m = corner();
  if (emissive)
    m.quad({1, 3, 1.5f}, {1.5f, 0, 0}, {0, 0, 1}, m.lambert(Vec3(0.0f), Vec3(50.0f)));
  else
    m.rectangle({1.75f, 3, 2}, {1, 0, 0}, {0, 0, -1}, {1.5f, 1}, Vec3(50.0f));
  return compare_with(bake(m.take(), kDensity, kSamples), receiver,
                      [](const Vec3& p, const Vec3& n) { return 50 * from_polygon(p, n, kPanel); });
}

// Foote 1915: a disc onto a parallel plane at height h, at distance d from its axis.
Outcome disc() {
  constexpr double r = 0.6, h = 3;
  SceneMaker m = corner().disc({2, 3, 2}, {0, -1, 0}, 0.6f, Vec3(50.0f));
  return compare_with(bake(m.take(), kDensity, kSamples), kFloor, [](const Vec3& p, const Vec3&) {
    const double d2 = (p.x - 2.0) * (p.x - 2.0) + (p.z - 2.0) * (p.z - 2.0), sum = h * h + d2 + r * r;
    return 50 * 0.5 * M_PI * (1 - (sum - 2 * r * r) / std::sqrt(sum * sum - 4 * r * r * d2));
  });
}

struct Receiving {
  uint32_t instance;
  double area;  // square metres
};
// Sum of E x area against a flux.
Outcome flux_of(const Bake& b, const std::vector<Receiving>& surfaces, double flux) {
  Outcome out{flux, 0, 0, 1};
  for (const auto& [instance, area] : surfaces) {
    const Outcome mean = compare_with(b, instance, [](const Vec3&, const Vec3&) { return 0.0; });
    out.measured += area * mean.measured;
    out.error = std::hypot(out.error, area * mean.error);
  }
  return out;
}

Outcome flux_of_a_lamp() {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.box({0, 0, 0}, {4, 3, 5}, true).point({1, 2.2f, 3.5f}, Vec3(100.0f));
  return flux_of(bake(m.take(), kDensity, kSamples), {{0, 20}, {1, 20}, {2, 12}, {3, 12}, {4, 15}, {5, 15}},
                 4 * M_PI * 100);
}

Outcome flux_through_an_opening() {
  SceneMaker m;
  const uint32_t black = m.lambert(Vec3(0.0f), Vec3(0.0f), true);
  m.box({0, 0, 0}, {4, 3, 5}, true);
  // In place of the ceiling: a roof around an opening of 2 x 2 m.
  m.quad({0, 3, 0}, {1, 0, 0}, {0, 0, 5}, black).quad({3, 3, 0}, {1, 0, 0}, {0, 0, 5}, black);
  m.quad({1, 3, 0}, {2, 0, 0}, {0, 0, 1.5f}, black).quad({1, 3, 3.5f}, {2, 0, 0}, {0, 0, 1.5f}, black);
  m.environment(Vec3(10.0f));
  Scene scene = m.take();
  scene.instances.erase(scene.instances.begin() + 1);
  receive_only(scene, {0, 1, 2, 3, 4});
  return flux_of(bake(std::move(scene), kDensity, 8192), {{0, 20}, {1, 12}, {2, 12}, {3, 15}, {4, 15}},
                 M_PI * 10 * 4);
}

}  // namespace

void add_lamp_cases(std::vector<CieCase>& cases) {
  const std::string inverse = "I cos / d^2", polygon = "Lambert's polygon formula";
  cases.push_back({"5.2", "isotropic lamp, floor", inverse, [] { return point_lamp(kFloor); }});
  cases.push_back({"5.2", "isotropic lamp, wall", inverse, [] { return point_lamp(kWall); }});
  cases.push_back({"5.2", "IES luminaire, floor", "I(C, gamma) cos / d^2", [] { return luminaire(kFloor); }});
  cases.push_back({"5.2", "IES luminaire, wall", "I(C, gamma) cos / d^2", [] { return luminaire(kWall); }});
  cases.push_back({"5.3", "panel of 1.5 x 1 m, floor", polygon, [] { return panel(kFloor, false); }});
  cases.push_back({"5.3", "panel of 1.5 x 1 m, wall", polygon, [] { return panel(kWall, false); }});
  cases.push_back({"5.3", "emissive surface, floor", polygon, [] { return panel(kFloor, true); }});
  cases.push_back({"5.3", "emissive surface, wall", polygon, [] { return panel(kWall, true); }});
  cases.push_back({"5.3", "disc of 0.6 m, floor", "Foote 1915", [] { return disc(); }});
  cases.push_back({"5.4", "flux of a lamp, closed room", "4 pi I", [] { return flux_of_a_lamp(); }});
  cases.push_back({"5.4", "flux through a roof opening", "pi L A", [] { return flux_through_an_opening(); }});
}

}  // namespace kiln::test
