// Points, spots and profiles: the formulas of the extensions, power as the integral of intensity, bounds.
#include "tests/lights/light_scenes.h"
#include "tests/lights/statistics.h"

namespace kiln {
namespace {

using test::Random;
using N = std::vector<double>;

template <class Light>
Light parse(const char* type, std::vector<Property> properties, const Mat4x3& to_world = Mat4x3(1.0f)) {
  const Record record{type, "l", to_world, std::move(properties)};
  RecordReader r(record);
  return Light::parse(r, to_world);
}
Property number(const char* name, double value) {
  return {name, {value}, "", {}};
}

TEST(Punctual, RangeWindow) {
  const auto l = parse<PointLight>("point", {number("intensity", 8), number("range", 4)});
  // max(min(1 - (d/range)^4, 1), 0) / d^2
  for (const double d : {0.01, 1.0, 2.0, 3.0, 3.9, 4.0, 5.0}) {
    const double truth = 8 * std::max(0.0, 1 - std::pow(d / 4, 4)) / (d * d);
    // Near the range 1 - q^2 cancels: rounding of q^2, times I / d^2.
    EXPECT_NEAR(l.irradiance(Vec3(0, static_cast<float>(d), 0)).x, truth, 4e-7 * 8 / (d * d)) << d;
  }
  EXPECT_EQ(l.irradiance(Vec3(0, 4, 0)).x, 0.0f);
  EXPECT_EQ(l.irradiance(Vec3(0)).x, 0.0f);
  EXPECT_FLOAT_EQ(parse<PointLight>("point", {number("intensity", 8)}).irradiance(Vec3(100, 0, 0)).x, 8e-4f);
}

TEST(Punctual, RangeCullsInTheTree) {
  test::SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}).point({0, 1, 0}, Vec3(1), 2).point({0, 9, 0}, Vec3(1000), 2);
  const test::LitScene scene = test::light_up(m.take());
  EXPECT_EQ(scene.lights.local.probability_of(0, Vec3(0), Vec3(0, 1, 0)), 1.0f);
  EXPECT_EQ(scene.lights.local.probability_of(1, Vec3(0), Vec3(0, 1, 0)), 0.0f);
  EXPECT_EQ(scene.lights.local.sample(*scene.surfaces, Vec3(0, 5, 0), Vec3(0, 1, 0), 0.5f, {}).weight,
            Vec3(0.0f));
}

TEST(Punctual, SpotCones) {
  for (const auto& [inner, outer] :
       {std::pair{0.0, 0.785}, {0.2, 0.3}, {0.3, 0.3}, {0.0, 0.01}, {0.5, 1.5707}}) {
    const auto l =
        parse<SpotLight>("spot", {number("intensity", 1), number("inner", inner), number("outer", outer)});
    const double fi = static_cast<float>(inner), fo = static_cast<float>(outer);
    const double scale = 1 / std::max(0.001, std::cos(fi) - std::cos(fo));
    for (double a = 0; a < 1.6; a += outer / 37) {
      const double t = std::clamp((std::cos(a) - std::cos(fo)) * scale, 0.0, 1.0);
      const Vec3 p(static_cast<float>(std::sin(a)), 0, static_cast<float>(-std::cos(a)));
      // A direction in floats is off by 2^-23, which moves the cosine by sin(a) of it.
      const double slack = 2 * scale * (std::sin(a) + 2e-6) * 3 * 0x1p-23 + 1e-6;
      EXPECT_NEAR(l.irradiance(p).x, t * t / static_cast<double>(dot(p, p)), slack) << a << " of " << outer;
    }
  }
}

// Integral of the intensity over the sphere by midpoints, finely enough for lights that are smooth but for
// kinks: the error is of second order in the step.
template <class Light>
double flux(const Light& l, int steps) {
  double sum = 0;
  for (int y = 0; y < steps; ++y)
    for (int x = 0; x < steps; ++x) {
      const double t0 = M_PI * y / steps, t1 = M_PI * (y + 1) / steps, t = 0.5 * (t0 + t1);
      const double phi = 2 * M_PI * (x + 0.5) / steps;
      const Vec3 d(std::sin(t) * std::cos(phi), std::sin(t) * std::sin(phi), -std::cos(t));
      sum += static_cast<double>(luminance(l.irradiance(l.position() + d))) * (std::cos(t0) - std::cos(t1)) *
             2 * M_PI / steps;
    }
  return sum;
}

TEST(Punctual, PowerIsTheIntegralOfIntensity) {
  const auto point = parse<PointLight>("point", {number("intensity", 8)});
  EXPECT_NEAR(point.power(), 8 * 4 * M_PI, 1e-5);
  for (const auto& [inner, outer] :
       {std::pair{0.0, 0.785}, {0.2, 0.5}, {1.0, 1.02}, {0.5, 1.5707}, {0.0, 0.04}}) {
    const auto l =
        parse<SpotLight>("spot", {number("intensity", 8), number("inner", inner), number("outer", outer)});
    double sum = 0;  // round the axis: one angle is enough
    constexpr int kSteps = 100000;
    for (int i = 0; i < kSteps; ++i) {
      const double h0 = 1 - std::cos(1.6 * i / kSteps), h1 = 1 - std::cos(1.6 * (i + 1) / kSteps);
      const double a = 1.6 * (i + 0.5) / kSteps;
      sum += static_cast<double>(l.irradiance(Vec3(std::sin(a), 0, -std::cos(a))).x) * (h1 - h0) * 2 * M_PI;
    }
    EXPECT_NEAR(l.power(), sum, 1e-3 * sum) << inner << " " << outer;
  }
}

IesLight profile(const N& vertical, const N& horizontal, const std::vector<float>& candela, Scene& scene,
                 const Mat4x3& to_world = Mat4x3(1.0f)) {
  test::add_ies(scene, Vec3(0.0f), vertical, horizontal, candela);
  scene.lights.back().to_world = to_world;
  RecordReader r(scene.lights.back());
  auto l = IesLight::parse(r, scene.lights.back(), scene);
  EXPECT_TRUE(l.has_value());
  return *l;
}

TEST(Ies, LooksUpByAngles) {
  Scene scene;
  const IesLight l =
      profile({0, 45, 90}, {0, 90, 180, 270, 360}, {10, 8, 0, 10, 6, 2, 10, 4, 4, 10, 2, 6, 10, 8, 0}, scene);
  const auto at = [&](double vertical, double horizontal) {
    const double t = vertical / 180 * M_PI, p = horizontal / 180 * M_PI;
    return l.irradiance(Vec3(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), -std::cos(t))).x;
  };
  // 1e-7 turns of the angles are 4e-5 degrees, at slopes below 8 cd in 45 degrees.
  constexpr double kSlack = 2e-5;
  EXPECT_NEAR(at(0, 0), 10, kSlack) << "nadir is -z";
  EXPECT_NEAR(at(45, 0), 8, kSlack) << "the horizontal angle is counted from +x";
  EXPECT_NEAR(at(45, 90), 6, kSlack) << "towards +y";
  EXPECT_NEAR(at(45, 270), 2, kSlack);
  EXPECT_NEAR(at(22.5, 45), 0.5 * (10 + 7), kSlack);
  EXPECT_NEAR(at(67.5, 315), 0.25 * (8 + 0 + 2 + 6), kSlack);
  EXPECT_EQ(at(91, 45), 0.0f) << "dark beyond the last vertical angle";
  const IesLight round = profile({0, 180}, {0}, {4, 0}, scene);
  EXPECT_NEAR(round.irradiance(Vec3(0, 2, 0)).x, 2.0 / 4, 1e-6);
}

TEST(Ies, PowerIsTheIntegralOfIntensity) {
  Scene scene;
  const IesLight tables[] = {profile({0, 180}, {0}, {5, 5}, scene),
                             profile({0, 45, 90}, {0}, {10, 8, 0}, scene),
                             profile({90, 120, 180}, {0, 90, 360}, {0, 5, 1, 2, 3, 1, 0, 5, 1}, scene),
                             profile({0, 30, 180}, {0, 90, 180, 270, 360},
                                     {10, 8, 0, 10, 6, 2, 10, 4, 4, 10, 2, 6, 10, 8, 0}, scene)};
  EXPECT_NEAR(tables[0].power(), 5 * 4 * M_PI, 1e-5);
  for (const IesLight& l : tables) EXPECT_NEAR(l.power(), flux(l, 720), 1e-3 * l.power());
}

TEST(Ies, BoundsHoldItsDirections) {
  Scene scene;
  const IesLight down = profile({0, 30, 60, 90}, {0}, {10, 8, 0, 0}, scene);
  EXPECT_NEAR(down.bounds().cos_normals, 0.5, 1e-6);
  EXPECT_EQ(down.bounds().axis, Vec3(0, 0, -1));
  const IesLight up = profile({90, 150, 180}, {0}, {0, 0, 9}, scene);
  EXPECT_EQ(up.bounds().axis, Vec3(0, 0, 1));
  EXPECT_NEAR(up.bounds().cos_normals, std::cos(M_PI / 6), 1e-6);
}

TEST(Ies, BadTablesAreRefused) {
  const auto refusal = [](const N& vertical, const N& horizontal, const std::vector<float>& candela) {
    Scene scene;
    test::add_ies(scene, Vec3(0.0f), {0, 90}, {0}, candela);
    scene.lights[0].properties[2].numbers = vertical;
    scene.lights[0].properties[3].numbers = horizontal;
    RecordReader r(scene.lights[0]);
    const auto l = IesLight::parse(r, scene.lights[0], scene);
    return l ? std::string() : l.error().message;
  };
  EXPECT_EQ(refusal({0, 90}, {0}, {1, 2}), "");
  EXPECT_NE(refusal({0, 90, 180}, {0}, {1, 2}).find("does not fit"), std::string::npos);
  EXPECT_NE(refusal({90, 0}, {0}, {1, 2}).find("rise"), std::string::npos);
  EXPECT_NE(refusal({0}, {0}, {1, 2}).find("rise"), std::string::npos);
  EXPECT_NE(refusal({0, 90}, {0, 90}, {1, 2}).find("rise"), std::string::npos);
  EXPECT_NE(refusal({0, 90}, {0}, {1, -2}).find("candela value 1"), std::string::npos);
}

// Every local light through LocalLights: weight times cosine is the irradiance of the formulas.
TEST(Punctual, SamplesGiveTheirIrradiance) {
  const Vec3 p(0.5f, 0, 0.2f), n(0, 1, 0);
  test::SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
  m.point({1, 2, 1}, Vec3(3))
      .point({-1, 1, 0}, Vec3(2), 3)
      .spot({0, 2, 0}, {0.2f, 0, 0}, Vec3(5), 0.3f, 0.8f);
  test::add_ies(m.scene(), {0, 1, 1}, {0, 180}, {0}, {4, 1});
  m.point({0, -1, 0}, Vec3(100));  // below
  const Scene scene = m.take();
  double truth = 0;
  for (const Record& record : scene.lights) {
    RecordReader r(record);
    const Vec3 d = record.to_world[3] - p;
    const Vec3 e = record.type == "ies"    ? IesLight::parse(r, record, scene)->irradiance(p)
                   : record.type == "spot" ? SpotLight::parse(r, record.to_world).irradiance(p)
                                           : PointLight::parse(r, record.to_world).irradiance(p);
    truth += static_cast<double>(e.x * std::max(0.0f, dot(d, n) / length(d)));
  }
  for (const LightChoice choice : {LightChoice::kTree, LightChoice::kPower, LightChoice::kUniform}) {
    const test::LitScene lit = test::light_up(scene, choice);
    test::Mean mean;
    Random random(3);
    for (int i = 0; i < 100000; ++i) {
      const LightSample s = lit.lights.local.sample(*lit.surfaces, p, n, random.one(), Vec2(0.5f));
      mean.add(static_cast<double>(s.weight.x * std::max(0.0f, dot(s.direction, n))));
    }
    test::expect_mean(mean, truth, "choice " + std::to_string(static_cast<int>(choice)));
  }
}

TEST(Punctual, BakeModes) {
  for (const char* type : {"point", "spot", "ies", "directional"}) {
    for (const char* mode : {"full", "indirect", "none"}) {
      test::SceneMaker m;
      m.lambert(Vec3(0.5f));
      m.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
      if (std::string(type) == "ies") {
        test::add_ies(m.scene(), {0, 0, 1}, {0, 180}, {0}, {4, 4});
      } else {
        Record r{type, "l", Mat4x3(1.0f), {number("intensity", 4)}};
        r.to_world[3] = Vec3(0, 0, 1);
        m.scene().lights.push_back(r);
      }
      m.scene().lights[0].properties.push_back({"bake", {}, mode, {}});
      const test::LitScene lit = test::light_up(m.take());
      EXPECT_TRUE(lit.warnings.empty()) << lit.warnings[0];
      const bool far = std::string(type) == "directional", none = std::string(mode) == "none";
      EXPECT_EQ(far ? lit.lights.directional.empty() : lit.lights.local.empty(), none) << type << mode;
      if (none) continue;
      const LightSample s =
          far ? lit.lights.directional.sample(0.5f, Vec2(0.5f))
              : lit.lights.local.sample(*lit.surfaces, Vec3(0), Vec3(0, 0, 1), 0.5f, Vec2(0.5f));
      EXPECT_FLOAT_EQ(s.weight.x, 4.0f) << type;
      EXPECT_EQ(s.indirect_only, std::string(mode) == "indirect") << type;
    }
  }
}

}  // namespace
}  // namespace kiln
