#include "common/base/format.h"
#include "tests/numerics/cases.h"

namespace kiln::test {
namespace {

Measured needle() {
  SceneMaker m;
  const uint32_t floor = m.lambert(Vec3(0.0f)), lamp = m.lambert(Vec3(0.0f), Vec3(1e7f));
  m.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, floor);
  const Vec3 o(-0.05f, 1, 0), u(0.1f, 0, 0), v(0, 0, 0.001f);
  m.quad(o, u, v, lamp);
  return ratio_to(bake(m.take(), 8, 256, {}, 0), 0, [=](const Vec3& p, const Vec3& n) {
    return 1e7 * polygon_irradiance(p, n, {o, o + v, o + v + u, o + u});
  });
}

Measured sky_under_sun() {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}).environment(Vec3(1.0f));
  const Bake sky = bake(m.scene(), 4, 1024);
  m.sun({0, 1, 0}, Vec3(1e5f));
  const MeanE both = mean_e(bake(m.take(), 4, 1024));
  // Each sample of 1e5 and a bit is rounded to 2^-8.
  return {M_PI, both.value - 1e5, 4 * mean_e(sky).error + 0x1p-8};
}

// Walls that emit 1 and reflect 0.99: pi (1 + 0.99 + ... + 0.99^n).
Measured bright_room(uint32_t max_bounces) {
  SceneMaker m;
  m.lambert(Vec3(0.99f), Vec3(1.0f));
  m.box({0, 0, 0}, {2, 1.5f, 1}, true);
  TransportSettings s;
  s.max_bounces = max_bounces;
  const MeanE e = mean_e(bake(m.take(), 2, 2560, s));
  const double truth = M_PI * (1 - std::pow(0.99, max_bounces + 1.0)) / (1 - 0.99);
  return against({e.value / truth, e.error / truth}, 1);
}

Scene glowing_room(double radiance) {
  SceneMaker m;
  m.lambert(Vec3(0.5f), Vec3(1.0f));
  m.scene().materials[0].properties[3].numbers.assign(3, radiance);
  m.box({0, 0, 0}, {2, 1.5f, 1}, true);
  return m.take();
}

Measured texels_not_scaled(int power) {
  const Bake one = bake(glowing_room(1), 4, 64), scaled = bake(glowing_room(std::ldexp(1.0, power)), 4, 64);
  double different = 0;
  for (size_t i = 0; i < one.texels.size(); ++i)
    for (int c = 0; c < 3; ++c) different += std::ldexp(one.texels[i].e[c], power) != scaled.texels[i].e[c];
  return {0, different, 0};
}

Measured mean_of_glow(double radiance) {
  const MeanE e = mean_e(bake(glowing_room(radiance), 4, 256));
  return against({e.value / radiance, e.error / radiance}, 2 * M_PI);
}

uint64_t nonfinite(double radiance) {
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = 2;
  Scene scene = glowing_room(radiance);
  Atlas atlas = build_atlas(scene, a).value();
  WorkUnit unit{0, 0, 64, {}};
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) unit.sites.push_back(site);
  const auto baker = Baker::create(std::move(scene), std::move(atlas), {}, 1).value();
  return baker->bake(unit).value().nonfinite;
}

// The largest power of two that the room may glow with before a contribution is beyond float.
Measured brightest() {
  int power = 100;
  while (power < 127 && nonfinite(std::ldexp(1.0, power + 1)) == 0) ++power;
  return {117, static_cast<double>(power), 3};
}

}  // namespace

void add_light_cases(std::vector<Case>& cases) {
  cases.push_back({"needle lamp, 10 cm by 1 mm, radiance 1e7",
                   "E of a floor over Lambert's polygon formula; four standard errors", needle});
  cases.push_back({"sky of 1 under a sun of 1e5 lx",
                   "E without the sun; four standard errors, and the rounding of the sum", sky_under_sun});
  for (const uint32_t bounces : {16u, 64u, 256u, 1024u, 100000u})
    cases.push_back({text("closed room of albedo 0.99, {} bounces", bounces),
                     text("E over its geometric sum, {:.5g}; four standard errors",
                          M_PI * (1 - std::pow(0.99, bounces + 1.0)) / (1 - 0.99)),
                     [bounces] { return bright_room(bounces); }});
  cases.push_back({"closed room of albedo 0.5, emission 1e30", "E / emission; four standard errors",
                   [] { return mean_of_glow(1e30); }});
  cases.push_back(
      {"the same, emission 1e-30", "E / emission; four standard errors", [] { return mean_of_glow(1e-30); }});
  cases.push_back({"the same, emission 1e-40 (denormal)", "E / emission; four standard errors",
                   [] { return mean_of_glow(1e-40); }});
  for (const int power : {100, -100})
    cases.push_back({text("the same, emission 2^{} against 1", power),
                     "channels of E that are not exactly as many times as large",
                     [power] { return texels_not_scaled(power); }});
  cases.push_back({"the same, emission 2^110 (1.3e33)", "contributions beyond float", [] {
                     return Measured{0, static_cast<double>(nonfinite(0x1p110)), 0};
                   }});
  cases.push_back(
      {"the same, largest emission without overflow",
       "exponent of two; a sample of light at distance d weighs area / d^2, here up to 2^10: error, the "
       "nearest of some 20,000 samples",
       brightest});
}

}  // namespace kiln::test
