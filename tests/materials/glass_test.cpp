// Glass over a floor against closed forms: shadow rays (sun), path rays (constant sky) and both under MIS
// (an emitting ceiling) must say the same.
#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

const Vec3 kColor(0.9f, 0.5f, 0.2f), kAbsorption(0.5f, 2.0f, 8.0f);

enum class Light { kSun, kSky, kCeiling };

struct Glass {
  Vec3 absorption{0.0f};
  double alpha = 1, specular = 1;
};

uint32_t add_glass(test::SceneMaker& m, const Glass& g) {
  Record r{"metallic_roughness", "glass", Mat4x3(1.0f), {}};
  const auto put = [&](const char* name, std::vector<double> v) {
    r.properties.push_back({name, std::move(v), "", {}});
  };
  put("base_color", {kColor.x, kColor.y, kColor.z, g.alpha});
  put("metallic", {0});
  put("roughness", {0});
  put("transmission", {1});
  put("specular", {g.specular});
  put("absorption", {g.absorption.x, g.absorption.y, g.absorption.z});
  if (g.alpha < 1) r.properties.push_back({"alpha_mode", {}, "blend", {}});
  m.scene().materials.push_back(r);
  return static_cast<uint32_t>(m.scene().materials.size() - 1);
}

void add_light(test::SceneMaker& m, Light light, uint32_t emitter) {
  if (light == Light::kSun) m.sun({0, 1, 0}, Vec3(1.0f));
  if (light == Light::kSky) m.environment(Vec3(1.0f));
  // Facing down; it reaches as far as the glass.
  if (light == Light::kCeiling) m.quad({-12, 0.2f, -12}, {24, 0, 0}, {0, 0, 24}, emitter);
}

// Roughness 0 is a GGX layer of width 0.02, which turns 0.02^2 of its normals by more than 45 degrees: so
// much of the reflectance 0.04 goes astray on each of at most two surfaces.
constexpr double kWidthOfSmooth = 2 * 0.04 * 0.02 * 0.02;

// Mean E over the floor, and how far it may be off: five standard errors, and for wide lights the light that
// the glass and ceiling do not reach to (cosines below 0.2/11 hold 3.3e-4 of E).
struct Measured {
  Vec3 e;
  double tolerance;
};
Measured floor_under(const Glass& g, Light light,
                     const std::function<void(test::SceneMaker&, uint32_t)>& build) {
  test::SceneMaker m;
  const uint32_t black = m.lambert(Vec3(0.0f)), emitter = m.lambert(Vec3(0.0f), Vec3(1.0f));
  m.quad({-0.25f, 0, -0.25f}, {0, 0, 0.5f}, {0.5f, 0, 0}, black);
  const uint32_t glass = add_glass(m, g);
  build(m, glass);
  add_light(m, light, emitter);
  TransportSettings settings;
  settings.max_bounces = 0;
  const auto b = test::bake(m.take(), 4, light == Light::kSun ? 16 : 16384, settings, 0u);
  Measured out{Vec3(0.0f), 0};
  double variance = 0;
  const auto n = static_cast<float>(b.texels.size());
  for (const auto& t : b.texels) {
    out.e += t.e / n;
    variance += t.standard_error * t.standard_error / (n * n);
  }
  out.tolerance = light == Light::kSun ? 2e-6 + kWidthOfSmooth : 5 * std::sqrt(variance) + 3.4e-4 * M_PI;
  return out;
}

// E of a light of radiance 1 everywhere (or a sun of 1) of which `passes(cos)` gets through.
template <class F>
double truth(Light light, const F& passes) {
  if (light == Light::kSun) return passes(1.0);
  double sum = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const double cos = (i + 0.5) / n;
    sum += 2 * M_PI * cos * passes(cos) / n;
  }
  return sum;
}
double enters(double cos) {  // 1 - Schlick's F of index 1.5, a smooth layer
  return 0.96 * (1 - std::pow(1 - cos, 5));
}

const char* name_of(Light l) {
  return l == Light::kSun ? "sun" : l == Light::kSky ? "sky" : "ceiling";
}
template <class F>
void expect(const Glass& g, const std::function<void(test::SceneMaker&, uint32_t)>& build, const F& passes) {
  for (const Light light : {Light::kSun, Light::kSky, Light::kCeiling}) {
    const Measured m = floor_under(g, light, build);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(m.e[k], truth(light, [&](double cos) { return passes(cos, k); }), m.tolerance)
          << name_of(light) << " channel " << k;
  }
}

// Its diagonal lies beside the floor: a ray along an edge that two triangles share meets both of them.
void pane(test::SceneMaker& m, uint32_t glass) {
  m.quad({-11, 0.1f, -13}, {0, 0, 24}, {24, 0, 0}, glass);
}

TEST(Glass, ThinPaneTintsWhatDoesNotReflect) {
  expect({}, pane, [](double cos, int k) { return kColor[k] * enters(cos); });
}
TEST(Glass, WithoutSpecularItOnlyTints) {
  Glass g;
  g.specular = 0;
  expect(g, pane, [](double, int k) { return kColor[k]; });
}
TEST(Glass, CoverageAndGlassMultiply) {
  Glass g;
  g.alpha = 0.25;
  expect(g, pane, [](double cos, int k) { return 0.75 + 0.25 * kColor[k] * enters(cos); });
}
TEST(Glass, TwoPanes) {
  const auto two = [](test::SceneMaker& m, uint32_t glass) {
    pane(m, glass);
    m.quad({-11, 0.15f, -13}, {24, 0, 0}, {0, 0, 24}, glass);  // seen from its other side
  };
  expect({}, two, [](double cos, int k) { return std::pow(kColor[k] * enters(cos), 2); });
}
TEST(Glass, ThickGlassAbsorbsByTheWayThroughIt) {
  Glass g;
  g.absorption = kAbsorption;
  const auto slab = [](test::SceneMaker& m, uint32_t glass) {
    m.box({-11, 0.05f, -13}, {13, 0.15f, 11}, false, glass);
  };
  expect(g, slab, [](double cos, int k) {
    return std::pow(kColor[k] * enters(cos), 2) * std::exp(-kAbsorption[k] * 0.1 / cos);
  });
}
TEST(Glass, FloorInsideOfThickGlass) {
  Glass g;
  g.absorption = kAbsorption;
  const auto block = [](test::SceneMaker& m, uint32_t glass) {
    m.box({-11, -0.1f, -13}, {13, 0.15f, 11}, false, glass);
  };
  expect(g, block,
         [](double cos, int k) { return kColor[k] * enters(cos) * std::exp(-kAbsorption[k] * 0.15 / cos); });
}

}  // namespace
}  // namespace kiln
