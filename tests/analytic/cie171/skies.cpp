#include "tests/analytic/cie171/skies.h"

namespace kiln::test {
namespace {

struct Parameters {
  double a, b;     // gradation
  double c, d, e;  // indicatrix
};
// CIE S 011/E:2003, table 1.
constexpr Parameters kGeneralSky[15] = {
    {4.0, -0.70, 0, -1.0, 0},      {4.0, -0.70, 2, -1.5, 0.15},   {1.1, -0.80, 0, -1.0, 0},
    {1.1, -0.80, 2, -1.5, 0.15},   {0.0, -1.00, 0, -1.0, 0},      {0.0, -1.00, 2, -1.5, 0.15},
    {0.0, -1.00, 5, -2.5, 0.30},   {0.0, -1.00, 10, -3.0, 0.45},  {-1.0, -0.55, 2, -1.5, 0.15},
    {-1.0, -0.55, 5, -2.5, 0.30},  {-1.0, -0.55, 10, -3.0, 0.45}, {-1.0, -0.32, 10, -3.0, 0.45},
    {-1.0, -0.32, 16, -3.0, 0.30}, {-1.0, -0.15, 16, -3.0, 0.30}, {-1.0, -0.15, 24, -2.8, 0.15}};

double gradation(const Parameters& p, double sine) {
  return 1 + p.a * std::exp(p.b / std::max(sine, 1e-9));
}
double indicatrix(const Parameters& p, double cos) {
  const double angle = std::acos(std::clamp(cos, -1.0, 1.0));
  return 1 + p.c * (std::exp(p.d * angle) - std::exp(p.d * M_PI / 2)) + p.e * cos * cos;
}

}  // namespace

double sky_radiance(int type, const DVec3& d, const DVec3& sun) {
  if (type == 16) return (1 + 2 * d.y) / 3;
  const Parameters& p = kGeneralSky[type - 1];
  return gradation(p, d.y) * indicatrix(p, glm::dot(d, sun)) / (gradation(p, 1) * indicatrix(p, sun.y));
}

void add_sky(SceneMaker& maker, int type, const DVec3& sun, double below) {
  maker.environment_image(1024, 512, [&](const Vec3& d) {
    return Vec3(static_cast<float>(d.y > 0 ? sky_radiance(type, DVec3(d), sun) : below));
  });
}

}  // namespace kiln::test
