// Irradiance against closed forms. Bounds are those of the product's promise: means within 0.5 %, and at
// least 95 % of texels within three stated standard errors.
#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

using test::SceneMaker;

void expect_true(const test::Comparison& c) {
  EXPECT_GT(c.texels, 50u);
  EXPECT_NEAR(c.mean, c.true_mean, 0.005 * c.true_mean);
  EXPECT_GE(c.share_within_3, 0.95);
}

// Lambert 1760: irradiance at p with normal n from a polygon of radiance L, all of it above the horizon:
// L/2 sum of angle_i (n . unit(v_i x v_i+1)). Vertices clockwise as seen from p give a positive sum.
double polygon_irradiance(const Vec3& p, const Vec3& n, const std::vector<Vec3>& polygon, double radiance) {
  double sum = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const DVec3 a = glm::normalize(DVec3(polygon[i] - p));
    const DVec3 b = glm::normalize(DVec3(polygon[(i + 1) % polygon.size()] - p));
    const DVec3 axis = glm::cross(a, b);
    const double s = glm::length(axis);
    if (s > 0) sum += std::atan2(s, glm::dot(a, b)) * glm::dot(DVec3(n), axis / s);
  }
  return 0.5 * radiance * std::abs(sum);
}

TEST(Irradiance, ConstantEnvironmentOverPlaneIsPi) {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}).environment(Vec3(1.0f));
  const auto b = test::bake(m.take(), 4, 256);
  expect_true(test::compare(b, [](uint32_t) { return M_PI; }));
}

TEST(Irradiance, ImageEnvironmentOverPlane) {
  // Radiance 1 + y above the horizon: E = pi + 2 pi/3, from the image's texels.
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  m.environment_image(
      128, 64, [](const Vec3& d) { return Vec3(1.0f + std::max(0.0f, d.y)); }, 0.5f);
  const auto b = test::bake(m.take(), 4, 256);
  // The image is constant per texel: integrate what is stored.
  double truth = 0;
  for (int y = 0; y < 32; ++y) {
    const double t0 = M_PI * y / 64, t1 = M_PI * (y + 1) / 64;
    truth += (1 + std::cos(M_PI * (y + 0.5) / 64)) * M_PI *
             (std::pow(std::sin(t1), 2) - std::pow(std::sin(t0), 2));
  }
  expect_true(test::compare(b, [&](uint32_t) { return 0.5 * truth; }));
}

TEST(Irradiance, SmallBrightSpotInTheEnvironment) {
  // One texel of 256 x 128 holds nearly all light: sampled, not met by chance.
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  const Vec3 spot = test::equirect_direction(40, 30, 256, 128);
  m.environment_image(256, 128, [&](const Vec3& d) { return Vec3(dot(d, spot) > 0.99999f ? 1e5f : 0.1f); });
  const auto b = test::bake(m.take(), 4, 256);
  const double t0 = M_PI * 30 / 128, t1 = M_PI * 31 / 128;
  const double spot_e =
      (1e5 - 0.1) * (2 * M_PI / 256) * 0.5 * (std::pow(std::sin(t1), 2) - std::pow(std::sin(t0), 2));
  expect_true(test::compare(b, [&](uint32_t) { return spot_e + 0.1 * M_PI; }));
}

TEST(Irradiance, PlaneUnderRectangularEmitter) {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  const uint32_t lamp = m.lambert(Vec3(0.0f), Vec3(7.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  m.quad({1, 1.5f, 1.2f}, {2, 0, 0}, {0, 0, 1}, lamp);  // faces down
  const auto b = test::bake(m.take(), 4, 512);
  const std::vector<Vec3> corners = {{1, 1.5f, 1.2f}, {3, 1.5f, 1.2f}, {3, 1.5f, 2.2f}, {1, 1.5f, 2.2f}};
  expect_true(test::compare(b, [&](uint32_t site) {
    return test::texel_average(
        b, site, [&](const Vec3& p, const Vec3& n) { return polygon_irradiance(p, n, corners, 7); });
  }));
}

// Paths alone meet a light by chance: the bound is what their own samples state, which is small enough to
// mean something.
void expect_true_of(MisMode mode, const test::Bake& bake, const test::Comparison& c) {
  SCOPED_TRACE(static_cast<int>(mode));
  if (mode != MisMode::kPaths) return expect_true(c);
  double squares = 0, texels = 0;
  for (const test::BakedTexel& t : bake.texels)
    if (t.instance == 0) squares += t.standard_error * t.standard_error, ++texels;
  const double error = std::sqrt(squares) / texels;
  EXPECT_LT(error, 0.005 * c.true_mean);
  EXPECT_NEAR(c.mean, c.true_mean, 4 * error);
  EXPECT_GE(c.share_within_3, 0.95);
}
uint32_t samples_of(MisMode mode) {
  return mode == MisMode::kPaths ? 4096 : 512;
}

TEST(Irradiance, PlaneUnderARectangleLight) {
  // By both strategies together and by each alone: none may find another light than the others.
  for (const MisMode mode : {MisMode::kBoth, MisMode::kLights, MisMode::kPaths}) {
    SceneMaker m;
    m.lambert(Vec3(0.0f));
    m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
    m.rectangle({2, 1.5f, 1.7f}, {1, 0, 0}, {0, 0, -1}, {2, 1}, Vec3(7.0f));  // faces down
    TransportSettings settings;
    settings.mis_mode = mode;
    const auto b = test::bake(m.take(), 4, samples_of(mode), settings);
    const std::vector<Vec3> corners = {{1, 1.5f, 1.2f}, {3, 1.5f, 1.2f}, {3, 1.5f, 2.2f}, {1, 1.5f, 2.2f}};
    expect_true_of(mode, b, test::compare(b, [&](uint32_t site) {
                     return test::texel_average(b, site, [&](const Vec3& p, const Vec3& n) {
                       return polygon_irradiance(p, n, corners, 7);
                     });
                   }));
  }
}

// Foote 1915: a disc of radius r onto a parallel surface at distance h, d away from its axis. On the axis it
// is pi L r^2 / (r^2 + h^2).
double disc_irradiance(double r, double h, double d, double radiance) {
  const double sum = h * h + d * d + r * r;
  return radiance * 0.5 * M_PI * (1 - (sum - 2 * r * r) / std::sqrt(sum * sum - 4 * r * r * d * d));
}

TEST(Irradiance, PlaneUnderADiscLight) {
  EXPECT_NEAR(disc_irradiance(0.8, 1.2, 0, 1), M_PI * 0.64 / (0.64 + 1.44), 1e-12);
  for (const MisMode mode : {MisMode::kBoth, MisMode::kLights, MisMode::kPaths}) {
    SceneMaker m;
    m.lambert(Vec3(0.0f));
    m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}).disc({1.8f, 1.2f, 2.3f}, {0, -1, 0}, 0.8f, Vec3(5.0f));
    TransportSettings settings;
    settings.mis_mode = mode;
    const auto b = test::bake(m.take(), 4, samples_of(mode), settings);
    expect_true_of(mode, b, test::compare(b, [&](uint32_t site) {
                     return test::texel_average(b, site, [&](const Vec3& p, const Vec3&) {
                       return disc_irradiance(0.8, 1.2, std::hypot(p.x - 1.8, p.z - 2.3), 5);
                     });
                   }));
  }
}

// One-sided it gives nothing behind; the back of a two-sided one gives what its front does. A sheet above it
// takes no light away, nor does the light itself.
TEST(Irradiance, SidesOfAnAreaLight) {
  const auto floor_under = [](int sides, bool turned, bool sky) {
    SceneMaker m;
    m.lambert(Vec3(0.0f));
    m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
    const float z = turned ? 1.0f : -1.0f;
    m.rectangle({2, 1.5f, 1.7f}, {1, 0, 0}, {0, 0, z}, {2, 1}, Vec3(7.0f), sides);
    if (sky) m.environment(Vec3(1.0f));
    const auto b = test::bake(m.take(), 2, 1024);
    return test::compare(b, [](uint32_t) { return 0.0; }).mean;
  };
  const double front = floor_under(1, false, false);
  EXPECT_GT(front, 0.5);
  EXPECT_EQ(floor_under(1, true, false), 0.0);
  EXPECT_NEAR(floor_under(2, true, false), front, 0.005 * front);
  EXPECT_NEAR(floor_under(1, true, true), M_PI, 0.005 * M_PI) << "it hides nothing";
  EXPECT_NEAR(floor_under(1, false, true), front + M_PI, 0.005 * (front + M_PI));
}

// A panel that lies in the surface of a ceiling shines into the room, whoever looks for it.
TEST(Irradiance, RectangleLightFlushWithACeiling) {
  for (const MisMode mode : {MisMode::kLights, MisMode::kPaths}) {
    SceneMaker m;
    m.lambert(Vec3(0.0f));
    m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
    m.quad({-3, 1.5f, -3}, {10, 0, 0}, {0, 0, 10});
    m.rectangle({2, 1.5f, 1.7f}, {1, 0, 0}, {0, 0, -1}, {2, 1}, Vec3(7.0f), 2);
    TransportSettings settings;
    settings.mis_mode = mode;
    const auto b = test::bake(m.take(), 4, samples_of(mode), settings);
    const std::vector<Vec3> corners = {{1, 1.5f, 1.2f}, {3, 1.5f, 1.2f}, {3, 1.5f, 2.2f}, {1, 1.5f, 2.2f}};
    expect_true_of(mode, b, test::compare(b, [&](uint32_t site) {
                     return test::texel_average(b, site, [&](const Vec3& p, const Vec3& n) {
                       return polygon_irradiance(p, n, corners, 7);
                     });
                   }));
    EXPECT_EQ(test::compare(
                  b, [](uint32_t) { return 0.0; }, 1)
                  .mean,
              0.0)
        << "the ceiling is in its plane";
  }
}

// Its direct light left to the engine: what the floor reflects onto a wall stays.
TEST(Irradiance, AreaLightBakedByItsReflectionsAlone) {
  const auto room = [](const char* bake) {
    SceneMaker m;
    m.lambert(Vec3(0.5f));
    m.quad({0, 0, 0}, {0, 0, 2}, {2, 0, 0});
    m.quad({0, 0, 2}, {0, 0, -2}, {0, 2, 0});
    m.rectangle({1, 1.9f, 1}, {1, 0, 0}, {0, 0, -1}, {0.6f, 0.6f}, Vec3(7.0f));
    m.disc({1, 1.5f, 0.5f}, {0, -1, 0}, 0.2f, Vec3(9.0f), 2);
    for (Record& light : m.scene().lights) light.properties.push_back({"bake", {}, bake, {}});
    return m.take();
  };
  const auto mean = [](const Scene& scene, bool direct) {
    TransportSettings settings;
    settings.direct = direct;
    double sum = 0;
    for (const test::BakedTexel& t : test::bake(scene, 4, 1024, settings).texels) sum += t.luminance;
    return sum;
  };
  const double reflected = mean(room("full"), false);
  EXPECT_GT(reflected, 0.0);
  EXPECT_NEAR(mean(room("indirect"), true), reflected, 0.005 * reflected);
  EXPECT_GT(mean(room("full"), true), 1.5 * reflected);
  EXPECT_EQ(mean(room("none"), true), 0.0);
}

// In the middle of a block of absorbing glass: on its way to the light a path is absorbed as far as there.
TEST(Irradiance, AreaLightInsideAbsorbingGlass) {
  const auto floor_of = [](MisMode mode, double absorption, double& error) {
    SceneMaker m;
    m.lambert(Vec3(0.0f));
    const uint32_t glass = m.metallic_roughness(Vec3(1.0f), 0, 1);
    m.scene().materials[glass].properties.push_back({"transmission", {1}, "", {}});
    m.scene().materials[glass].properties.push_back(
        {"absorption", {absorption, absorption, absorption}, "", {}});
    m.quad({0, 0, 0}, {0, 0, 2}, {2, 0, 0});
    m.box({0.2f, 0.4f, 0.2f}, {1.8f, 1.4f, 1.8f}, false, glass);
    m.disc({1, 1, 1}, {0, -1, 0}, 0.4f, Vec3(5.0f));
    TransportSettings settings;
    settings.mis_mode = mode;
    settings.indirect = false;
    const auto b = test::bake(m.take(), 4, 4096, settings, 0);
    double sum = 0, squares = 0;
    for (const test::BakedTexel& t : b.texels)
      sum += t.luminance, squares += t.standard_error * t.standard_error;
    error = std::sqrt(squares) / b.texels.size();
    return sum / b.texels.size();
  };
  double lights_error = 0, paths_error = 0;
  const double lights = floor_of(MisMode::kLights, 1.5, lights_error);
  const double paths = floor_of(MisMode::kPaths, 1.5, paths_error);
  const double error = std::hypot(lights_error, paths_error);
  EXPECT_LT(error, 0.01 * lights);
  EXPECT_NEAR(lights, paths, 4 * error);
  EXPECT_LT(lights, 0.6 * floor_of(MisMode::kBoth, 0, lights_error))
      << "0.6 m of it pass 41 %, slanted ways less";
}

TEST(Irradiance, EmitterDoesNotShineBackwards) {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  const uint32_t lamp = m.lambert(Vec3(0.0f), Vec3(7.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  m.quad({1, 1.5f, 1.2f}, {0, 0, 1}, {2, 0, 0}, lamp);  // faces up
  const auto b = test::bake(m.take(), 2, 64);
  EXPECT_EQ(test::compare(b, [](uint32_t) { return 0.0; }).mean, 0.0);
}

double point_irradiance(const Vec3& p, const Vec3& n, const Vec3& lamp, double intensity) {
  const DVec3 d(lamp - p);
  const double d2 = glm::dot(d, d);
  return intensity * std::max(0.0, glm::dot(d, DVec3(n))) / (d2 * std::sqrt(d2));
}

TEST(Irradiance, PointLight) {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}).point({1.3f, 0.8f, 2.1f}, Vec3(12.0f));
  const auto b = test::bake(m.take(), 4, 256);
  expect_true(test::compare(b, [&](uint32_t site) {
    return test::texel_average(b, site, [](const Vec3& p, const Vec3& n) {
      return point_irradiance(p, n, {1.3f, 0.8f, 2.1f}, 12);
    });
  }));
}

TEST(Irradiance, ManyPointLightsChosenByPower) {
  // Enough lamps for several levels of the light tree.
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  std::vector<std::pair<Vec3, float>> lamps;
  for (int i = 0; i < 40; ++i) lamps.push_back({Vec3(0.1f * i, 2.0f, 0.07f * (i * 7 % 40)), 1.0f + i % 5});
  for (const auto& [p, i] : lamps) m.point(p, Vec3(i));
  const auto b = test::bake(m.take(), 4, 512);
  expect_true(test::compare(b, [&](uint32_t site) {
    return test::texel_average(b, site, [&](const Vec3& p, const Vec3& n) {
      double sum = 0;
      for (const auto& [q, i] : lamps) sum += point_irradiance(p, n, q, i);
      return sum;
    });
  }));
}

TEST(Irradiance, SpotLight) {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  const Vec3 lamp(2, 3, 2), aim(1.5f, 0, 2.3f);
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}).spot(lamp, aim, Vec3(30.0f), 0.2f, 0.5f);
  const auto b = test::bake(m.take(), 4, 512);
  const DVec3 axis = glm::normalize(DVec3(aim - lamp));
  expect_true(test::compare(b, [&](uint32_t site) {
    return test::texel_average(b, site, [&](const Vec3& p, const Vec3& n) {
      const double c = glm::dot(glm::normalize(DVec3(p - lamp)), axis);
      const double t = std::clamp((c - std::cos(0.5)) / (std::cos(0.2) - std::cos(0.5)), 0.0, 1.0);
      return point_irradiance(p, n, lamp, 30) * t * t;
    });
  }));
}

TEST(Irradiance, SunWithAndWithoutAngularSize) {
  for (float degrees : {0.0f, 0.53f, 20.0f}) {
    SceneMaker m;
    m.lambert(Vec3(0.0f));
    m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}).sun({1, 1, 0.5f}, Vec3(1000.0f), degrees);
    const auto b = test::bake(m.take(), 4, 256);
    // Above the horizon the disc's irradiance is its facing one times the cosine, whatever its size.
    expect_true(test::compare(b, [](uint32_t) { return 1000.0 / 1.5; }));
  }
}

TEST(Irradiance, SunDiscCutByAWall) {
  // Penumbra: a wall's straight edge hides part of a 20 degree disc. Truth by quadrature over the disc.
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  const uint32_t black = m.lambert(Vec3(0.0f), Vec3(0.0f), true);
  m.quad({0, 0, 0}, {0, 0, 1}, {6, 0, 0}, 0);
  m.quad({0, 0, -40}, {0, 0, 81}, {0, 2, 0}, black);
  m.sun({-1, 1, 0}, Vec3(10.0f), 20);
  const auto b = test::bake(m.take(), 4, 1024, {}, 0);
  const auto truth = [&](const Vec3& p, const Vec3&) {
    const double half = 10 * M_PI / 180;
    const DVec3 axis = glm::normalize(DVec3(-1, 1, 0)), side(0, 0, 1), up = glm::cross(side, axis);
    double sum = 0;
    const int n = 48;
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k) {
        const double z = 1 - (1 - std::cos(half)) * (i + 0.5) / n, r = std::sqrt(1 - z * z),
                     a = 2 * M_PI * (k + 0.5) / n;
        const DVec3 d = axis * z + side * (r * std::cos(a)) + up * (r * std::sin(a));
        const bool hidden = d.x < 0 && p.x / -d.x * d.y < 2;
        if (!hidden) sum += d.y;
      }
    const double solid_angle = 2 * M_PI * (1 - std::cos(half)),
                 radiance = 10 / (M_PI * std::pow(std::sin(half), 2));
    return radiance * solid_angle * sum / (n * n);
  };
  const auto c = test::compare(b, [&](uint32_t site) { return test::texel_average(b, site, truth); });
  EXPECT_NEAR(c.mean, c.true_mean, 0.005 * c.true_mean);
  EXPECT_GE(c.share_within_3, 0.95);
}

TEST(Irradiance, EnvironmentAboveAWall) {
  // A black wall of height h and infinite length beside a floor point at distance x hides the wedge of
  // elevation below atan(h/x) on its side: E = pi - pi/2 (1 - x/sqrt(x^2 + h^2)).
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  const uint32_t black = m.lambert(Vec3(0.0f), Vec3(0.0f), true);
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, 0);
  m.quad({0, 0, -5000}, {0, 0, 10004}, {0, 2, 0}, black);
  m.environment(Vec3(1.0f));
  Scene scene = m.take();
  const auto baked = test::bake(std::move(scene), 4, 512, {}, 0);
  expect_true(test::compare(baked, [&](uint32_t site) {
    return test::texel_average(baked, site, [](const Vec3& p, const Vec3&) {
      return M_PI - M_PI / 2 * (1 - p.x / std::sqrt(double{p.x} * p.x + 4));
    });
  }));
}

TEST(Irradiance, SphereInUniformLight) {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.sphere({0, 0, 0}, 1, 48).environment(Vec3(1.0f));
  const auto b = test::bake(m.take(), 8, 256);
  // A facet whose smooth normal leans by a against its plane loses the sliver of sky below the plane:
  // pi (1 - cos a)/2, at most 1e-3 pi here (a < 180/48 degrees), far inside the stated errors.
  expect_true(test::compare(b, [](uint32_t) { return M_PI; }));
}

TEST(Irradiance, MirroredInstanceShadesAsItsTwin) {
  SceneMaker m;
  m.lambert(Vec3(0.0f));
  m.quad({1, 0, 0}, {0, 0, 2}, {2, 0.5f, 0});
  Scene s = m.environment(Vec3(1.0f)).sun({0.3f, 1, 0}, Vec3(2.0f)).take();
  Instance twin = s.instances[0];
  twin.to_world[0] = Vec3(-1, 0, 0);  // mirrored in x
  twin.name = "twin";
  s.instances.push_back(twin);
  const auto b = test::bake(std::move(s), 8, 256);
  const DVec3 n = glm::normalize(DVec3(-0.5, 2, 0)), sun = glm::normalize(DVec3(0.3, 1, 0));
  for (uint32_t i = 0; i < 2; ++i) {
    // The two face each other across a valley: each loses the little sky that the other covers.
    const DVec3 ni(i ? -n.x : n.x, n.y, 0);
    const auto c = test::compare(
        b, [&](uint32_t) { return M_PI + 2 * glm::dot(ni, sun); }, i);
    EXPECT_NEAR(c.mean, c.true_mean, 0.05 * c.true_mean) << i;
    EXPECT_GT(c.mean, M_PI * 0.95) << i;
  }
}

TEST(Irradiance, AlphaBlendedPaneCastsAFractionalShadow) {
  for (double opacity : {0.0, 0.25, 1.0}) {
    SceneMaker m;
    m.lambert(Vec3(0.0f));
    m.quad({0, 0, 0}, {0, 0, 2}, {2, 0, 0});
    m.scene().materials.push_back({"metallic_roughness",
                                   "pane",
                                   Mat4x3(1.0f),
                                   {{"base_color", {0, 0, 0, opacity}, "", {}},
                                    {"metallic", {0}, "", {}},
                                    {"specular", {0}, "", {}},
                                    {"alpha_mode", {}, "blend", {}},
                                    {"double_sided", {1}, "", {}}}});
    m.quad({-50, 1, -50}, {0, 0, 100}, {100, 0, 0}, 1);
    m.sun({0, 1, 0}, Vec3(3.0f)).environment(Vec3(1.0f));
    const auto b = test::bake(m.take(), 4, 512, {}, 0);
    const auto c = test::compare(b, [&](uint32_t) { return (3 + M_PI) * (1 - opacity); });
    // The pane ends at 50 m: at most (1/50)^2 of the sky comes in below it.
    EXPECT_NEAR(c.mean, c.true_mean, 0.005 * c.true_mean + M_PI * opacity / 2500) << opacity;
  }
}

}  // namespace
}  // namespace kiln
