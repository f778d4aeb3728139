// Which surfaces' irradiance is read, and that what is read is E albedo / pi. Reading draws no random number
// of a Lambert surface, so a path that does not read is bit for bit the path without a cache, and one that
// reads meets what would have been met had the wall emitted E albedo / pi.
#include <cmath>

#include "common/responses/basis.h"
#include "tests/analytic/scene_maker.h"
#include "tests/cache/cached_bake.h"

namespace kiln {
namespace {

using test::CachedBake;
using test::SceneMaker;

constexpr uint32_t kSamples = 64;
constexpr float kTexelsPerMetre = 8;  // hits are near below half a metre
const Vec3 kKnown(3, 2, 1);           // of the cache: not what light there is

TransportSettings paths() {
  TransportSettings s;
  s.mis_mode = MisMode::kPaths;
  return s;
}

// A receiver that looks up at a wall which looks down at it from `height`, in uniform light. The wall's
// front is turned away if `away`.
Scene facing(float height, const std::function<uint32_t(SceneMaker&)>& material, bool away = false) {
  SceneMaker m;
  const uint32_t black = m.lambert(Vec3(0.0f));
  const uint32_t wall = material(m);
  m.quad({-0.25f, 0, -0.25f}, {0, 0, 0.5f}, {0.5f, 0, 0}, black);
  const Vec3 u(4, 0, 0), v(0, 0, 4);
  m.quad({-2, height, -2}, away ? v : u, away ? u : v, wall);
  m.environment(Vec3(0.5f));
  return m.take();
}

std::function<uint32_t(SceneMaker&)> lambert(float albedo, const Vec3& emission = Vec3(0.0f),
                                             bool double_sided = false) {
  return [=](SceneMaker& m) { return m.lambert(Vec3(albedo), emission, double_sided); };
}

// E of the receiver's sites.
std::vector<double> receiver_e(const CachedBake& b, const IrradianceCache* cache) {
  const auto result = b.run(0, kSamples, cache);
  EXPECT_TRUE(result) << result.error().message;
  std::vector<double> out;
  for (uint32_t s = 0; s < b.sites(); ++s)
    if (b.instance_of(s) == 0)
      for (size_t p : {kMomentER, kMomentEG, kMomentEB})
        out.push_back(result->moments[s * result->plane_count + p] / kSamples);
  return out;
}

std::vector<double> with_cache(const Scene& scene, const Vec3& known = kKnown) {
  const CachedBake b(scene, kTexelsPerMetre, paths());
  const IrradianceCache cache = test::uniform_cache(b.sites(), known);
  return receiver_e(b, &cache);
}
std::vector<double> without(const Scene& scene) {
  return receiver_e(CachedBake(scene, kTexelsPerMetre, paths()), nullptr);
}

void expect_near(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GT(a.size(), 0u);
  for (size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-5 * std::abs(b[i])) << i;
}

TEST(Reading, IsAsIfTheWallEmittedWhatItReflects) {
  expect_near(with_cache(facing(2, lambert(0.6f))),
              without(facing(2, lambert(0, kKnown * 0.6f / float(M_PI)))));
}

TEST(Reading, OwnLightOfTheWallIsAdded) {
  const Vec3 own(1, 4, 2);
  expect_near(with_cache(facing(2, lambert(0.6f, own))),
              without(facing(2, lambert(0, own + kKnown * 0.6f / float(M_PI)))));
}

TEST(Reading, BlackIsKnown) {
  expect_near(with_cache(facing(2, lambert(0.6f)), Vec3(0.0f)), without(facing(2, lambert(0))));
}

TEST(Reading, PathsGoOnWhereNothingIsKnown) {
  const Scene scene = facing(2, lambert(0.6f));
  EXPECT_EQ(with_cache(scene, Vec3(-1, 3, 3)), without(scene));
  EXPECT_NE(with_cache(scene), without(scene));
}

TEST(Reading, PathsGoOnNearTheSurface) {
  // From a quarter of a metre on, a texel of 1/8 m is read. No point of the wall is that far from the
  // receiver: corner to opposite corner it is 0.23 m.
  SceneMaker m;
  const uint32_t black = m.lambert(Vec3(0.0f)), white = m.lambert(Vec3(0.6f));
  m.quad({-0.05f, 0, -0.05f}, {0, 0, 0.1f}, {0.1f, 0, 0}, black);
  m.quad({-0.1f, 0.1f, -0.1f}, {0.2f, 0, 0}, {0, 0, 0.2f}, white);
  m.quad({-3, -1, -3}, {0, 0, 6}, {6, 0, 0}, black);  // more than the wall sees
  m.environment(Vec3(0.5f));
  const Scene scene = m.take();
  EXPECT_EQ(with_cache(scene), without(scene));
}

TEST(Reading, PathsGoOnAtBackFaces) {
  const Scene scene = facing(2, lambert(0.6f, Vec3(0.0f), true), true);
  EXPECT_EQ(with_cache(scene), without(scene));
}

TEST(Reading, PathsGoOnAtGlass) {
  const Scene scene = facing(2, [](SceneMaker& m) {
    const uint32_t glass = m.metallic_roughness(Vec3(0.8f), 0, 0.5f);
    m.scene().materials[glass].properties.push_back({"transmission", {0.9}, "", {}});
    m.scene().materials[glass].properties.push_back({"double_sided", {1}, "", {}});
    return glass;
  });
  EXPECT_EQ(with_cache(scene), without(scene));
}

TEST(Reading, KnownIrradianceIsReadUnderSheenAndCoat) {
  const auto covered_by = [](const std::vector<Property>& layers) {
    return facing(2, [&](SceneMaker& m) {
      const uint32_t wall = m.metallic_roughness(Vec3(0.8f), 0, 0.5f);
      for (const Property& p : layers) m.scene().materials[wall].properties.push_back(p);
      return wall;
    });
  };
  const Scene coat = covered_by({{"clearcoat", {0.7}, "", {}}}),
              sheen = covered_by({{"sheen_color", {0.5, 0.5, 0.5}, "", {}}}), bare = covered_by({});
  EXPECT_NE(with_cache(coat), without(coat));
  EXPECT_NE(with_cache(sheen), without(sheen));
  EXPECT_NE(with_cache(bare), without(bare));
}

// The wall's normals turned by an angle about its tangent.
Scene turned(float degrees) {
  Scene scene = facing(2, lambert(0.6f));
  const double angle = degrees * M_PI / 180;
  Texture t;
  t.name = "normals";
  t.width = t.height = 1;
  t.channels = 3;
  t.format = TexelFormat::kUnorm8;
  for (const double c : {std::sin(angle), 0.0, std::cos(angle)})
    t.texels.push_back(std::byte(static_cast<uint8_t>(std::lround((c + 1) * 127.5))));
  Property map{"normal_texture", {}, "", {}};
  map.texture.texture = static_cast<int32_t>(scene.textures.size());
  map.texture.uv_set = 1;
  scene.textures.push_back(std::move(t));
  scene.materials[1].properties.push_back(map);
  return scene;
}

TEST(Reading, PathsGoOnWhereANormalMapTurnsFar) {
  EXPECT_EQ(with_cache(turned(40)), without(turned(40)));
  EXPECT_NE(with_cache(turned(10)), without(turned(10)));  // cos 10 degrees is above kMinAgreement
}

TEST(Reading, NoReflectionsNoReading) {
  TransportSettings s = paths();
  s.indirect = false;
  const CachedBake b(facing(2, lambert(0.6f)), kTexelsPerMetre, s);
  const IrradianceCache cache = test::uniform_cache(b.sites(), kKnown);
  EXPECT_EQ(receiver_e(b, &cache), receiver_e(b, nullptr));
}

TEST(Reading, CacheOfAnotherSizeIsRefused) {
  const CachedBake b(facing(2, lambert(0.6f)), kTexelsPerMetre, paths());
  for (const size_t size : {size_t{0}, b.sites() - 1, b.sites() + 1}) {
    const IrradianceCache cache = test::uniform_cache(size, kKnown);
    const auto result = b.run(0, 1, &cache);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind, ErrorKind::kInvalidInput);
  }
}

TEST(Reading, ReplicatesAndTakesDrawTheirOwnSamples) {
  // Whatever shape the light has, the difference of two runs of samples is noise, and so is any two such
  // differences' correlation over sites: 1 / sqrt(sites) in the standard deviation, 4 of which are 6e-5.
  const CachedBake b(facing(2, lambert(0.6f)), kTexelsPerMetre, paths());
  const auto luminance = [&](uint32_t replicate, uint32_t take, uint32_t first) {
    const auto result = b.run(first, kSamples, nullptr, replicate, take);
    std::vector<double> out;
    for (uint32_t s = 0; s < b.sites(); ++s)
      out.push_back(result->moments[s * result->plane_count + kMomentLum]);
    return out;
  };
  ASSERT_GT(b.sites(), 500u);
  const std::vector<double> a0 = luminance(0, 0, 0), a1 = luminance(0, 0, kSamples);
  for (const auto& [replicate, take] : {std::pair(1u, 0u), std::pair(0u, 1u), std::pair(1u, 1u)}) {
    const std::vector<double> b0 = luminance(replicate, take, 0), b1 = luminance(replicate, take, kSamples);
    double ab = 0, aa = 0, bb = 0;
    for (size_t s = 0; s < b.sites(); ++s) {
      const double a = a0[s] - a1[s], c = b0[s] - b1[s];
      ab += a * c;
      aa += a * a;
      bb += c * c;
    }
    ASSERT_GT(aa, 0);
    EXPECT_LT(std::abs(ab), 4 / std::sqrt(b.sites()) * std::sqrt(aa * bb)) << replicate << " " << take;
  }
}

TEST(Reading, UnitsWithoutACacheDoNotDependOnOthers) {
  const CachedBake b(facing(2, lambert(0.6f)), kTexelsPerMetre, paths());
  const auto before = b.run(0, kSamples);
  const IrradianceCache cache = test::uniform_cache(b.sites(), kKnown);
  ASSERT_TRUE(b.run(0, kSamples, &cache));  // makes the lookup
  EXPECT_EQ(b.run(0, kSamples)->moments, before->moments);
  EXPECT_EQ(b.run(0, kSamples)->rays, before->rays);
}

}  // namespace
}  // namespace kiln
