// 5.5: a sun at an angle through a pane.
#include "tests/analytic/cie171/cases.h"
#include "tests/analytic/cie171/glass.h"

namespace kiln::test {

uint32_t add_clear_glass(SceneMaker& maker) {
  Record r{"metallic_roughness", "glass", Mat4x3(1.0f), {}};
  for (const char* name : {"transmission", "metallic", "roughness"})
    r.properties.push_back({name, {name[0] == 't' ? 1.0 : 0.0}, "", {}});
  r.properties.push_back({"base_color", {1, 1, 1, 1}, "", {}});
  r.properties.push_back({"absorption", {0, 0, 0}, "", {}});
  maker.scene().materials.push_back(std::move(r));
  return static_cast<uint32_t>(maker.scene().materials.size() - 1);
}

double through_pane(double cos) {
  const double surface = 0.96 * (1 - std::pow(1 - cos, 5));
  return surface * surface;
}

double through_fresnel_pane(double cos) {
  const double inside = std::sqrt(1 - (1 - cos * cos) / (1.5 * 1.5));
  const double s = (cos - 1.5 * inside) / (cos + 1.5 * inside),
               p = (inside - 1.5 * cos) / (inside + 1.5 * cos);
  return 0.5 * ((1 - s * s) / (1 + s * s) + (1 - p * p) / (1 + p * p));
}

namespace {

Outcome sun_through_pane(double degrees) {
  const double angle = degrees * M_PI / 180;
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  const uint32_t glass = add_clear_glass(m);
  m.quad({0, 0, 0}, {0, 0, 2}, {2, 0, 0});
  // Its diagonals lie beside the floor: a ray along an edge that two triangles share meets both of them.
  m.box({-3, 0.1f, -4}, {5, 0.106f, 8}, false, glass);
  m.sun(Vec3(static_cast<float>(std::sin(angle)), static_cast<float>(std::cos(angle)), 0), Vec3(1000.0f));
  Scene scene = m.take();
  receive_only(scene, {0});
  TransportSettings settings;
  settings.max_bounces = 0;  // no reflections inside the pane
  return compare_with(bake(std::move(scene), 4, 64, settings), 0, [&](const Vec3&, const Vec3&) {
    return 1000 * std::cos(angle) * through_pane(std::cos(angle));
  });
}

}  // namespace

void add_glass_cases(std::vector<CieCase>& cases) {
  for (const int degrees : {0, 20, 40, 60, 70, 80})
    cases.push_back({"5.5", "sun at " + std::to_string(degrees) + " degrees through a pane",
                     "cos (1 - F)^2, Schlick's F", [degrees] { return sun_through_pane(degrees); }});
}

}  // namespace kiln::test
