// 5.9 and 5.10: daylight on the floor of a black room through an opening in its roof.
#include "tests/analytic/cie171/cases.h"
#include "tests/analytic/cie171/glass.h"
#include "tests/analytic/cie171/skies.h"

namespace kiln::test {
namespace {

constexpr double kLow = 0.5, kHigh = 3.5, kHeight = 3;   // opening: x and z in [kLow, kHigh], at this y
const DVec3 kSun = glm::normalize(DVec3(-1, 0.6, 0.5));  // 28 degrees high: not seen through the opening

// L cos cos / d^2 over the opening.
double through_roof(int type, bool glazed, const Vec3& p) {
  return integrate(kLow, kHigh, [&](double x) {
    return integrate(kLow, kHigh, [&](double z) {
      const DVec3 d = DVec3(x, kHeight, z) - DVec3(p);
      const double d2 = glm::dot(d, d);
      const DVec3 w = d / std::sqrt(d2);
      return sky_radiance(type, w, kSun) * (glazed ? through_pane(w.y) : 1.0) * w.y * w.y / d2;
    });
  });
}

Outcome roof(int type, bool glazed) {
  SceneMaker m;
  const uint32_t black = m.lambert(Vec3(0.0f), Vec3(0.0f), true);
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, black);
  m.quad({0, 3, 0}, {0.5f, 0, 0}, {0, 0, 4}, black).quad({3.5f, 3, 0}, {0.5f, 0, 0}, {0, 0, 4}, black);
  m.quad({0.5f, 3, 0}, {3, 0, 0}, {0, 0, 0.5f}, black);
  m.quad({0.5f, 3, 3.5f}, {3, 0, 0}, {0, 0, 0.5f}, black);
  m.quad({0, 0, 0}, {4, 0, 0}, {0, 3, 0}, black).quad({0, 0, 4}, {4, 0, 0}, {0, 3, 0}, black);
  m.quad({0, 0, 0}, {0, 0, 4}, {0, 3, 0}, black).quad({4, 0, 0}, {0, 0, 4}, {0, 3, 0}, black);
  if (glazed) m.box({-1, 3.01f, -2}, {5, 3.016f, 6.5f}, false, add_clear_glass(m));
  add_sky(m, type, kSun, 0);
  Scene scene = m.take();
  receive_only(scene, {0});
  TransportSettings settings;
  settings.max_bounces = 0;
  return compare_with(bake(std::move(scene), 2, 40960, settings), 0,
                      [&](const Vec3& p, const Vec3&) { return through_roof(type, glazed, p); });
}

}  // namespace

void add_roof_cases(std::vector<CieCase>& cases) {
  const auto name = [](int type) {
    return type == 16 ? std::string("overcast sky (1 + 2 sin) / 3") : "sky type " + std::to_string(type);
  };
  for (int type = 1; type <= kSkyTypes; ++type)
    cases.push_back({"5.9", "roof opening, " + name(type), "quadrature over the opening",
                     [type] { return roof(type, false); }});
  for (const int type : {5, 12, 16})
    cases.push_back({"5.10", "glazed roof opening, " + name(type), "quadrature over the opening",
                     [type] { return roof(type, true); }});
}

}  // namespace kiln::test
