// Directions and points on lights against their densities, for every light that has a density.
#include <functional>

#include "common/math/frame.h"
#include "tests/lights/light_scenes.h"
#include "tests/lights/statistics.h"

namespace kiln {
namespace {

using test::Mean;
using test::Random;
using test::SceneMaker;

SceneMaker with_floor() {
  SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
  return m;
}

// Sky with a gradient, black texels, and one texel 10^9 times brighter than the rest.
SceneMaker with_sky(uint32_t width, uint32_t height, double rotation) {
  SceneMaker m = with_floor();
  m.environment_image(width, height, [&](const Vec3& d) {
    const Vec3 sun = test::equirect_direction(width / 3, height / 4, width, height);
    if (dot(d, sun) > 0.99999f) return Vec3(1e9f, 1e9f, 5e8f);
    return d.y < -0.5f ? Vec3(0.0f) : Vec3(1.5f + d.x, 1.0f + 0.5f * d.z, 1.0f + d.y);
  });
  m.scene().lights.back().properties.push_back({"rotation", {rotation}, "", {}});
  return m;
}

TEST(Sampling, EnvironmentByItsDensity) {
  for (const auto& [width, height] : {std::pair{16u, 8u}, {31u, 15u}}) {
    const test::LitScene scene = test::light_up(with_sky(width, height, 77).take());
    const Environment& sky = scene.lights.environment;
    ASSERT_TRUE(sky.wants_sampling());
    std::vector<double> expected, counts(size_t{width} * height, 0);
    double integral = 0;
    const double turn = 77.0 / 180 * M_PI;
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x) {
        const Vec3 d = test::equirect_direction(x, y, width, height);  // of the image; now into the world
        const Vec3 world(d.x * std::cos(turn) + d.z * std::sin(turn), d.y,
                         d.z * std::cos(turn) - d.x * std::sin(turn));
        const double omega =
            2 * M_PI / width * (std::cos(M_PI * y / height) - std::cos(M_PI * (y + 1) / height));
        integral += static_cast<double>(sky.pdf(world)) * omega;
        expected.push_back(static_cast<double>(sky.pdf(world)) * omega);
      }
    EXPECT_NEAR(integral, 1, 1e-6);  // floats of pdf and solid angle
    constexpr int kDraws = 400000;
    Random random(1);
    int apart = 0;
    for (int i = 0; i < kDraws; ++i) {
      const LightSample s = sky.sample(random.two());
      ASSERT_NEAR(length(s.direction), 1, 1e-6);
      apart += std::abs(s.pdf - sky.pdf(s.direction)) > 1e-6f * s.pdf;
      const double azimuth =
          std::atan2(static_cast<double>(s.direction.z), static_cast<double>(s.direction.x)) + turn;
      const double u = azimuth / (2 * M_PI) + 0.5;
      const auto x = static_cast<uint32_t>((u - std::floor(u)) * width) % width;
      const auto y = std::min(
          height - 1, static_cast<uint32_t>(std::acos(static_cast<double>(s.direction.y)) / M_PI * height));
      counts[size_t{y} * width + x] += 1;
    }
    EXPECT_LE(apart, 4 * kDraws * 1e-5) << "but for directions within rounding of a texel's edge";
    // Those few may count next door.
    for (double& e : expected) e = e * kDraws + (e == 0 ? 1e-3 : 0);
    EXPECT_EQ(test::chi_square(expected, counts), "");
  }
}

TEST(Sampling, EnvironmentFindsWhatIsFaintBesideASun) {
  // All but 10^-7 of the light is in one texel; the rest must still be found as often as stated: the weights
  // of the faint texels are then what they hold.
  SceneMaker m = with_floor();
  m.environment_image(64, 32, [&](const Vec3& d) {
    return dot(d, test::equirect_direction(20, 8, 64, 32)) > 0.99999f ? Vec3(3e9f) : Vec3(1.0f);
  });
  const test::LitScene scene = test::light_up(m.take());
  Random random(2);
  int faint = 0;
  constexpr int kDraws = 1000;
  for (int i = 0; i < kDraws; ++i) {
    // Numbers at the ends of the rows' range, where the sun's row is not.
    for (const float u : {0x1p-24f, 1 - 0x1p-24f}) {
      const LightSample s = scene.lights.environment.sample(Vec2(u, random.one()));
      EXPECT_GT(s.pdf, 0.0f);
      faint +=
          s.weight.x / (1e9f * 0x1p-24f) < 1e-3f || scene.lights.environment.radiance(s.direction).x == 1.0f;
    }
  }
  EXPECT_GT(faint, kDraws / 4);
  EXPECT_GT(scene.lights.environment.pdf(Vec3(0, -1, 0)), 0.0f);
}

TEST(Sampling, EnvironmentGivesItsIrradiance) {
  for (const double rotation : {0.0, 200.0}) {
    const test::LitScene scene = test::light_up(with_sky(16, 8, rotation).take());
    const Environment& sky = scene.lights.environment;
    double truth = 0;  // per texel: integral of cos theta over it
    for (uint32_t y = 0; y < 4; ++y) {
      const double t0 = M_PI * y / 8, t1 = M_PI * (y + 1) / 8;
      for (uint32_t x = 0; x < 16; ++x) {
        const Vec3 d = test::equirect_direction(x, y, 16, 8);
        const double turn = rotation / 180 * M_PI;
        const Vec3 world(d.x * std::cos(turn) + d.z * std::sin(turn), d.y,
                         d.z * std::cos(turn) - d.x * std::sin(turn));
        truth += static_cast<double>(luminance(sky.radiance(world))) * 2 * M_PI / 16 * 0.5 *
                 (std::pow(std::sin(t1), 2) - std::pow(std::sin(t0), 2));
      }
    }
    Mean mean;
    Random random(3);
    for (int i = 0; i < 200000; ++i) {
      const LightSample s = sky.sample(random.two());
      mean.add(static_cast<double>(luminance(s.weight)) * std::max(0.0f, s.direction.y));
    }
    test::expect_mean(mean, truth, "environment");
  }
}

TEST(Sampling, ConstantEnvironmentIsLeftToTheSurface) {
  const test::LitScene scene = test::light_up(with_floor().environment(Vec3(1, 2, 3)).take());
  const Environment& sky = scene.lights.environment;
  EXPECT_FALSE(sky.wants_sampling());
  EXPECT_FALSE(sky.is_black());
  EXPECT_EQ(sky.pdf(Vec3(0, 1, 0)), 0.0f);
  EXPECT_EQ(sky.radiance(Vec3(0, -1, 0)), Vec3(1, 2, 3));
}

TEST(Sampling, SunDisc) {
  const Vec3 to_sun = normalize_or(Vec3(1, 2, -0.5f), Vec3(0));
  for (const float degrees : {0.53f, 20.0f, 120.0f}) {
    const test::LitScene scene = test::light_up(with_floor().sun(to_sun, Vec3(5.0f), degrees).take());
    const DirectionalLights& sun = scene.lights.directional;
    const double half = static_cast<double>(degrees) / 360 * M_PI, h = 2 * std::pow(std::sin(half / 2), 2);
    const Frame frame(to_sun);
    std::vector<double> counts(8 * 8, 0);
    constexpr int kDraws = 100000;
    Mean facing;
    Random random(4);
    for (int i = 0; i < kDraws; ++i) {
      const LightSample s = sun.sample(0.5f, random.two());
      EXPECT_EQ(s.pdf, 0.0f);
      facing.add(static_cast<double>(s.weight.x) * std::max(0.0f, dot(s.direction, to_sun)));
      // 1 - cos from the chord, which does not cancel; the frame is the sampler's only up to rotation.
      const Vec3 chord = s.direction - to_sun, local = frame.to_local(s.direction);
      const double along = 0.5 * static_cast<double>(dot(chord, chord)) / h;
      const double turns = std::atan2(local.y, local.x) / (2 * M_PI) + 0.5;
      // The chord of unit vectors in floats is known to 2^-23.
      EXPECT_LE(along, 1 + 4 * 0x1p-23 / std::sqrt(2 * h));
      counts[static_cast<size_t>(std::min(7.0, along * 8)) * 8 +
             static_cast<size_t>(std::min(7.0, turns * 8))] += 1;
    }
    EXPECT_EQ(test::chi_square(std::vector<double>(64, kDraws / 64.0), counts), "") << degrees;
    test::expect_mean(facing, 5, "a disc gives its irradiance to a surface that faces it");
  }
}

TEST(Sampling, SunsAreChosenByLuminance) {
  const Vec3 up(0, 1, 0), aside = normalize_or(Vec3(1, 1, 0), up);
  const test::LitScene scene =
      test::light_up(with_floor().sun(up, Vec3(3.0f)).sun(aside, Vec3(1.0f), 1).take());
  double first = 0;
  Mean mean;
  Random random(5);
  constexpr int kDraws = 100000;
  for (int i = 0; i < kDraws; ++i) {
    const float u = random.one();
    const LightSample s = scene.lights.directional.sample(u, random.two());
    first += s.direction == up;
    mean.add(static_cast<double>(s.weight.x) * s.direction.y);
  }
  EXPECT_NEAR(first / kDraws, 0.75, 4.6 * std::sqrt(0.75 * 0.25 / kDraws));
  test::expect_mean(mean, 3 + std::sqrt(0.5), "two suns");
}

// A one-sided quad of two triangles over the floor; flat or textured.
struct Panel {
  const char* name;
  std::function<void(SceneMaker&, const Vec3& o, const Vec3& u, const Vec3& v)> add;
  std::function<double(double s, double t)> radiance;  // over [0, 1]^2
};
std::vector<Panel> panels() {
  // One row of texels that rises; between their centres the filter is linear, beyond them constant.
  const auto ramp = [](double s) { return std::clamp(4 * s - 0.5, 0.0, 3.0); };
  return {{"flat",
           [](SceneMaker& m, const Vec3& o, const Vec3& u, const Vec3& v) {
             m.quad(o, u, v, m.lambert(Vec3(0), Vec3(2)));
           },
           [](double, double) { return 2.0; }},
          {"two-sided",
           [](SceneMaker& m, const Vec3& o, const Vec3& u, const Vec3& v) {
             m.quad(o, v, u, m.lambert(Vec3(0), Vec3(2), true));
           },
           [](double, double) { return 2.0; }},
          {"textured",
           [](SceneMaker& m, const Vec3& o, const Vec3& u, const Vec3& v) {
             Texture t = test::gray_texture(4, 1, {0, 1, 2, 3});
             t.wrap_s = t.wrap_t = Wrap::kClamp;
             textured_quad(m, o, u, v, test::emissive_texture(m, t));
           },
           [ramp](double s, double) { return ramp(s); }}};
}

TEST(Sampling, EmissiveTrianglesByTheirDensity) {
  const Vec3 o(-1, 2, -0.5f), u(2, 0.3f, 0), v(0, 0, 1.5f), p(0.4f, 0, 0.2f), n(0, 1, 0);  // u x v is down
  const DVec3 du(u), dv(v);
  for (const Panel& panel : panels()) {
    SceneMaker m = with_floor();
    panel.add(m, o, u, v);
    const test::LitScene scene = test::light_up(m.take());
    const LocalLights& lights = scene.lights.local;
    ASSERT_EQ(lights.size(), 2u);
    // Quadrature over the panel: of the density, which must be one over the sphere, and of the irradiance.
    constexpr int kSteps = 128, kBins = 8;
    std::vector<double> expected(kBins * kBins, 0), counts(kBins * kBins, 0);
    double integral = 0, truth = 0;
    const DVec3 normal = glm::normalize(glm::cross(du, dv));
    const double cell = glm::length(glm::cross(du, dv)) / (kSteps * kSteps);
    const Instance& last = scene.surfaces->scene().instances.back();
    const bool swapped = std::string(panel.name) == "two-sided";  // wound the other way round
    EXPECT_EQ(last.mesh, 1u);
    for (int j = 0; j < kSteps; ++j)
      for (int i = 0; i < kSteps; ++i) {
        const double s = (i + 0.5) / kSteps, t = (j + 0.5) / kSteps;
        const DVec3 q = DVec3(o) + du * s + dv * t, d = q - DVec3(p);
        const double d2 = glm::dot(d, d), cos_light = -glm::dot(normal, d) / std::sqrt(d2);
        ASSERT_GT(cos_light * (normal.y < 0 ? 1 : -1), 0);
        const double c = std::abs(cos_light);
        // Triangle 0 is below the diagonal of the quad as it was made; on the diagonal both count half.
        const double across = swapped ? s - t : t - s;
        double pdf = 0;
        for (const uint32_t triangle : {0u, 1u}) {
          const double share = across == 0 ? 0.5 : (across > 0) == (triangle == 1) ? 1 : 0;
          if (share > 0)
            pdf += share * static_cast<double>(lights.pdf(p, n, 1, triangle, static_cast<float>(c),
                                                          static_cast<float>(std::sqrt(d2))));
        }
        integral += pdf * c / d2 * cell;
        expected[static_cast<size_t>(j * kBins / kSteps * kBins + i * kBins / kSteps)] += pdf * c / d2 * cell;
        truth += panel.radiance(s, t) * c * d.y / std::sqrt(d2) / d2 * cell;
      }
    EXPECT_NEAR(integral, 1, 1e-5)
        << panel.name;  // density per area is constant on each triangle: float rounding
    constexpr int kDraws = 200000;
    Mean mean;
    Random random(6);
    for (int i = 0; i < kDraws; ++i) {
      const float choice = random.one();
      const LightSample l = lights.sample(*scene.surfaces, p, n, choice, random.two());
      ASSERT_GT(l.pdf, 0.0f);
      mean.add(static_cast<double>(l.weight.x) * l.direction.y);
      // The point, from the direction: the segment ends a little before it.
      const DVec3 d(l.direction);
      const double t = glm::dot(DVec3(o) - DVec3(p), normal) / glm::dot(d, normal);
      const DVec3 q = DVec3(p) + d * t - DVec3(o);
      const double a = std::clamp(glm::dot(q, du) / glm::dot(du, du), 0.0, 0.999999),
                   b = std::clamp(glm::dot(q, dv) / glm::dot(dv, dv), 0.0, 0.999999);
      counts[static_cast<size_t>(b * kBins) * kBins + static_cast<size_t>(a * kBins)] += 1;
      const double across = swapped ? a - b : b - a;
      if (std::abs(across) < 1e-4) continue;
      const float same = lights.pdf(p, n, 1, across > 0 ? 1 : 0,
                                    static_cast<float>(std::abs(glm::dot(d, normal))), static_cast<float>(t));
      ASSERT_NEAR(l.pdf, same, 4e-6f * l.pdf) << panel.name;  // distance, cosine and area in floats
    }
    for (double& e : expected) e *= kDraws;
    EXPECT_EQ(test::chi_square(expected, counts), "") << panel.name;
    // The midpoint rule is off by (1/128)^2 of second derivatives that are about one here.
    EXPECT_NEAR(mean.value(), truth, 4.6 * mean.error() + truth / (128 * 128)) << panel.name;
  }
}

TEST(Sampling, EmittersOfHugeAndTinyRadianceStayFinite) {
  for (const float radiance : {1e30f, 1e-40f}) {
    SceneMaker m = with_floor();
    for (int i = 0; i < 5; ++i)
      m.quad({static_cast<float>(i), 2, 0}, {1, 0, 0}, {0, 0, 1},
             m.lambert(Vec3(0), Vec3(i ? 1.0f : radiance)));
    const test::LitScene scene = test::light_up(m.take());
    Random random(7);
    for (int i = 0; i < 10000; ++i) {
      const float u = random.one();
      const LightSample s =
          scene.lights.local.sample(*scene.surfaces, Vec3(0), Vec3(0, 1, 0), u, random.two());
      ASSERT_TRUE(is_finite(s.weight) && std::isfinite(s.pdf));
    }
    for (uint32_t instance = 1; instance < 6; ++instance)
      EXPECT_GT(scene.lights.local.pdf(Vec3(0), Vec3(0, 1, 0), instance, 0, 0.5f, 2), 0.0f);
  }
}

TEST(Sampling, CutOutsDoNotShine) {
  // An emitter whose alpha says that it is not there; and half there.
  for (const auto& [mode, alpha, factor] :
       {std::tuple{"mask", 0.25, 0.0}, {"blend", 0.25, 0.25}, {"opaque", 0.25, 1.0}}) {
    SceneMaker m = with_floor();
    const uint32_t glow = m.lambert(Vec3(0), Vec3(2));
    auto& properties = m.scene().materials[glow].properties;
    properties[0].numbers[3] = alpha;
    properties.push_back({"alpha_mode", {}, mode, {}});
    m.quad({-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, glow);
    const test::LitScene scene = test::light_up(m.take());
    const LightSample s =
        scene.lights.local.sample(*scene.surfaces, Vec3(0), Vec3(0, 1, 0), 0.3f, Vec2(0.3f));
    EXPECT_NEAR(s.weight.x * s.pdf, 2 * factor, 1e-6) << mode;
  }
}

}  // namespace
}  // namespace kiln
