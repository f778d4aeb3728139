// Ambient occlusion, sky visibility and bent normals against closed forms and quadrature, and their reported
// errors.
#include <cmath>

#include "coordinator/bake/merge/response_errors.h"
#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln::test {
namespace {

enum Response : uint32_t { kAo, kSky, kBent };  // of the roster

TransportSettings only(std::vector<uint32_t> responses, bool light = false) {
  TransportSettings s;
  s.quantities = {light, std::move(responses)};
  return s;
}

constexpr float kWall = 1.0f, kLength = 200.0f, kDeep = 2.0f;

// A floor of 2 x 0.5 m that begins at the foot (x = 0) of a wall of 1 m, and the wall is endless.
Scene floor_by_wall() {
  SceneMaker make;
  const uint32_t grey = make.lambert(Vec3(0.5f));
  make.quad(Vec3(0, 0, 0.25f), Vec3(kDeep, 0, 0), Vec3(0, 0, -0.5f), grey);
  make.quad(Vec3(0, 0, kLength / 2), Vec3(0, 0, -kLength), Vec3(0, kWall, 0), grey);
  return make.take();
}

double sky_by_wall(double x) {
  return 1 - 0.5 * (1 - x / std::sqrt(x * x + kWall * kWall));
}

// Integral over the hemisphere above the floor of cos / pi times f(direction, distance to the wall), by the
// midpoint rule in cos^2 and angle; the distance is infinite beside and above the wall.
template <int kRings = 400, int kSectors = 1600, class F>
double over_hemisphere(double x, const F& f) {
  double sum = 0;
  for (int i = 0; i < kRings; ++i) {
    const double y = std::sqrt((i + 0.5) / kRings), r = std::sqrt(1 - y * y);
    for (int k = 0; k < kSectors; ++k) {
      const double a = 2 * M_PI * (k + 0.5) / kSectors, dx = r * std::cos(a);
      const double to_wall = dx < 0 ? x / -dx : INFINITY;
      sum += f(DVec3(dx, y, r * std::sin(a)), to_wall * y < kWall ? to_wall : INFINITY);
    }
  }
  return sum / kRings / kSectors;
}

// The same of f(distance) alone, coarser: for means over a texel's 64 points.
template <class F>
double over_hemisphere_coarse(double x, const F& f) {
  return over_hemisphere<60, 240>(x, [&](const DVec3&, double distance) { return f(distance); });
}

// Both replicates of every texel of instance 0 of a scene.
struct Responses2 {
  Bake bake;
  std::vector<TexelErrors> errors;  // by response of the settings
};
Responses2 bake_responses(Scene scene, float texels_per_metre, uint32_t samples, const TransportSettings& s) {
  Responses2 out{test::bake(std::move(scene), texels_per_metre, samples, s, 0), {}};
  out.errors = response_errors(*out.bake.sums, charts_of_sites(out.bake.atlas));
  return out;
}

float value(const Bake& b, const char* plane, uint32_t site) {
  return b.map.responses.plane(plane)[b.atlas.sites.texel[site]];
}

TEST(Responses, SkyBesideAWall) {
  const Responses2 r = bake_responses(floor_by_wall(), 16, 4096, only({kSky}));
  double mean = 0, truth = 0;
  size_t within = 0;
  for (const BakedTexel& t : r.bake.texels) {
    const double exact =
        texel_average(r.bake, t.site, [](const Vec3& p, const Vec3&) { return sky_by_wall(p.x); });
    const double sky = value(r.bake, "sky", t.site);
    EXPECT_NEAR(sky, exact, 0.005 * exact + 4 * r.errors[0].standard_error[t.site]);
    within += std::abs(sky - exact) <= 1.96 * r.errors[0].standard_error[t.site];
    mean += sky;
    truth += exact;
  }
  ASSERT_GT(r.bake.texels.size(), 200u);
  EXPECT_NEAR(mean, truth, 0.005 * truth);
  // 95 % less three standard errors of a share of so many texels.
  const double share = static_cast<double>(within) / static_cast<double>(r.bake.texels.size());
  EXPECT_GE(share, 0.95 - 3 * std::sqrt(0.95 * 0.05 / static_cast<double>(r.bake.texels.size())));
}

TEST(Responses, BentNormalsBesideAWall) {
  const Responses2 r = bake_responses(floor_by_wall(), 8, 16384, only({kSky, kBent}));
  for (const BakedTexel& t : r.bake.texels) {
    const double x = t.position.x;
    DVec3 m(0);
    for (int c = 0; c < 3; ++c)
      m[c] = over_hemisphere(
          x, [c](const DVec3& d, double distance) { return std::isinf(distance) ? d[c] : 0.0; });
    const DVec3 bent(value(r.bake, "bent.X", t.site), value(r.bake, "bent.Y", t.site),
                     value(r.bake, "bent.Z", t.site));
    // Its length is the sky visibility of the same samples.
    EXPECT_NEAR(glm::length(bent), value(r.bake, "sky", t.site), 1e-5);
    // The mean of the texel's points turns with x; a quarter of a degree is for that.
    const double cos = glm::dot(glm::normalize(bent), glm::normalize(m));
    const double degrees = std::acos(std::min(1.0, cos)) * 180 / M_PI;
    EXPECT_LT(degrees, 0.5) << "at " << x;
  }
}

TEST(Responses, OcclusionWithinADistance) {
  for (const Falloff falloff : {Falloff::kNone, Falloff::kLinear, Falloff::kSmooth}) {
    TransportSettings s = only({kAo});
    s.response = {0.75f, falloff};
    const Responses2 r = bake_responses(floor_by_wall(), 8, 4096, s);
    double mean = 0, truth = 0;
    for (const BakedTexel& t : r.bake.texels) {
      mean += value(r.bake, "ao", t.site);
      truth += texel_average(r.bake, t.site, [&](const Vec3& p, const Vec3&) {
        // Coarser than over_hemisphere: there are 64 points a texel.
        return over_hemisphere_coarse(p.x, [&](double distance) {
          const double q = std::min(1.0, distance / 0.75);
          if (falloff == Falloff::kNone) return q < 1 ? 0.0 : 1.0;
          return falloff == Falloff::kLinear ? q : q * q * (3 - 2 * q);
        });
      });
    }
    const double texels = static_cast<double>(r.bake.texels.size());
    EXPECT_NEAR(texels - mean, texels - truth, 0.01 * (texels - truth)) << falloff_name(falloff);
  }
}

TEST(Responses, OcclusionBeyondTheSceneIsTheSkyToTheBit) {
  TransportSettings s = only({kAo, kSky});
  s.response.ao_distance = 1e6f;
  const Bake b = test::bake(floor_by_wall(), 8, 256, s, 0);
  size_t partly = 0;
  for (const BakedTexel& t : b.texels) {
    EXPECT_EQ(value(b, "ao", t.site), value(b, "sky", t.site));
    partly += value(b, "sky", t.site) < 0.9f;
  }
  EXPECT_GT(partly, 10u);
}

TEST(Responses, SkyTimesPiTimesRadianceIsIrradiance) {
  Scene scene = floor_by_wall();
  SceneMaker make;
  scene.lights = make.environment(Vec3(0.7f)).take().lights;
  TransportSettings s = only({kSky}, true);
  s.indirect = false;
  const Bake b = test::bake(std::move(scene), 8, 512, s, 0);
  for (const BakedTexel& t : b.texels)
    EXPECT_NEAR(t.e.x, kPi * 0.7f * value(b, "sky", t.site), 2e-6f * 512);  // a rounding a sample
}

TEST(Responses, LightLeftOutChangesNoOther) {
  TransportSettings with = only({kAo, kSky, kBent}, true), without = only({kAo, kSky, kBent});
  with.response.ao_distance = without.response.ao_distance = 0.5f;
  const Bake a = test::bake(floor_by_wall(), 8, 64, with, 0),
             b = test::bake(floor_by_wall(), 8, 64, without, 0);
  EXPECT_FALSE(b.map.has_light);
  ASSERT_EQ(a.map.responses.names, b.map.responses.names);
  for (size_t p = 0; p < a.map.responses.data.size(); ++p)
    EXPECT_EQ(a.map.responses.data[p], b.map.responses.data[p]) << a.map.responses.names[p];
}

TEST(Responses, HalfOfACardLetsHalfOfTheSkyThrough) {
  SceneMaker make;
  make.lambert(Vec3(0.5f));
  make.scene().materials.push_back({"metallic_roughness",
                                    "card",
                                    Mat4x3(1.0f),
                                    {{"base_color", {0, 0, 0, 0.5}, "", {}},
                                     {"metallic", {0}, "", {}},
                                     {"alpha_mode", {}, "blend", {}},
                                     {"double_sided", {1}, "", {}}}});
  make.quad(Vec3(-1, 0, 1), Vec3(2, 0, 0), Vec3(0, 0, -2));
  make.quad(Vec3(-50, 1, 50), Vec3(100, 0, 0), Vec3(0, 0, -100), 1);
  const Bake b = test::bake(make.take(), 8, 4096, only({kSky}), 0);
  double mean = 0;
  for (const BakedTexel& t : b.texels) mean += value(b, "sky", t.site);
  mean /= static_cast<double>(b.texels.size());
  // The card ends at 49 m or more: at most (1/49)^2 of the sky is seen below its edge.
  EXPECT_NEAR(mean, 0.5, 0.0025 + 0.5 / (49 * 49));
}

// A response in one file: what a roster asks of an entry.
struct Nearness : StoredAsIs {
  static constexpr size_t kComponents = 1;
  static constexpr std::array<std::string_view, 1> stored{"Y"};
  static constexpr std::string_view name = "near", about = "how near the first surface is, 1/m";
  static constexpr bool is_signed = false;
  static void evaluate(const PrimaryRay& ray, const ResponseSettings&, float* out) {
    out[0] = ray.escaped() ? 0.0f : 1.0f / ray.distance;
  }
};

TEST(Responses, OneMoreIsOneStructAndOneEntry) {
  using WithOneMore = ResponseRoster<AmbientOcclusion, Nearness>;
  ASSERT_EQ(WithOneMore::all().size(), 2u);
  EXPECT_EQ(WithOneMore::all()[1].name, "near");
  EXPECT_EQ(WithOneMore::index_of<Nearness>(), 1u);
  double sums[2] = {0, 0};
  PrimaryRay ray;
  ray.weight = 1;
  ray.distance = 4;
  WithOneMore::accumulate(1, ray, {}, sums);
  WithOneMore::accumulate(1, ray, {}, sums);
  EXPECT_EQ(sums[0], 0.5);
  EXPECT_EQ(sums[1], 0.125);
}

// A chimney whose opening hardly any ray finds: few samples see no sky at all, and must not claim to be sure.
TEST(Responses, SamplesThatAgreeProveLittle) {
  SceneMaker make;
  make.lambert(Vec3(0.5f));
  make.quad(Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(0, 0, -1));
  constexpr float kUp = 6;
  make.quad(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, kUp, 0));
  make.quad(Vec3(1, 0, 1), Vec3(-1, 0, 0), Vec3(0, kUp, 0));
  make.quad(Vec3(0, 0, 1), Vec3(0, 0, -1), Vec3(0, kUp, 0));
  make.quad(Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0, kUp, 0));
  const Scene scene = make.take();
  const Responses2 truth = bake_responses(scene, 8, 1 << 14, only({kSky}));
  const Responses2 few = bake_responses(scene, 8, 4, only({kSky}));
  ASSERT_EQ(truth.bake.texels.size(), few.bake.texels.size());
  size_t within = 0, blind = 0;
  for (const BakedTexel& t : few.bake.texels) {
    const double exact = value(truth.bake, "sky", t.site), sky = value(few.bake, "sky", t.site);
    blind += sky == 0;
    EXPECT_GT(exact, 0);
    within += std::abs(sky - exact) <= 1.96 * few.errors[0].standard_error[t.site];
  }
  const double texels = static_cast<double>(few.bake.texels.size());
  EXPECT_GT(blind, 0.8 * texels);  // else it tests nothing
  EXPECT_GE(within / texels, 0.95 - 3 * std::sqrt(0.95 * 0.05 / texels));
}

TEST(Responses, NothingSeenIsNoDirection) {
  const ResponseInfo& bent = response_roster()[kBent];
  const float means[4] = {0, 0, 0, 0}, errors[4] = {0, 0, 0, 0};
  float stored[3] = {1, 1, 1};
  bent.resolve(means, stored);
  EXPECT_EQ(Vec3(stored[0], stored[1], stored[2]), Vec3(0));
  EXPECT_EQ(bent.standard_error(means, errors), 0);
}

}  // namespace
}  // namespace kiln::test
