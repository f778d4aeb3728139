// Mean emission of triangles against the texture that paths see.
#include "tests/lights/light_scenes.h"
#include "tests/lights/statistics.h"
#include "worker/lights/emission_map.h"

namespace kiln {
namespace {

using test::Random;

// Means of the first material by its map, for a triangle with these texture coordinates.
struct Case {
  Scene scene;
  std::unique_ptr<Surfaces> surfaces;
  const Material& material() const { return surfaces->material(0); }
  double mean(const Vec2 (&uv)[3], size_t triangles = 1) const {
    Attributes a[3];
    for (int k = 0; k < 3; ++k) a[k].uv[0] = uv[k];
    return EmissionMap(emission_parts(material()), triangles).mean(a);
  }
  // By points of the material's own lookup.
  test::Mean truth(const Vec2 (&uv)[3], int n, uint64_t seed) const {
    test::Mean out;
    Random random(seed);
    for (int i = 0; i < n; ++i) {
      Vec2 b = random.two();
      if (b.x + b.y > 1) b = Vec2(1) - b;
      Attributes a;
      a.uv[0] = uv[0] * (1 - b.x - b.y) + uv[1] * b.x + uv[2] * b.y;
      out.add(static_cast<double>(luminance(emission_at(material(), a))));
    }
    return out;
  }
};
Case with(Texture texture) {
  test::SceneMaker m;
  const uint32_t material = test::emissive_texture(m, std::move(texture));
  m.quad({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, material);
  std::vector<std::string> warnings;
  Case c;
  c.surfaces = std::move(*Surfaces::create(m.take(), warnings));
  return c;
}

Texture noise(uint32_t width, uint32_t height, uint64_t seed) {
  Random random(seed);
  std::vector<float> texels;
  for (uint32_t i = 0; i < width * height; ++i)
    texels.push_back(random.one() < 0.8f ? 0.0f : 10 * random.one());
  return test::gray_texture(width, height, texels);
}

TEST(EmissionMap, MeanOfTheFilterOverTheTriangle) {
  Random random(1);
  for (const bool nearest : {false, true})
    for (const Wrap wrap : {Wrap::kRepeat, Wrap::kClamp, Wrap::kMirror}) {
      Texture t = noise(7, 5, 2);
      t.nearest = nearest;
      t.wrap_s = t.wrap_t = wrap;
      const Case c = with(t);
      for (int i = 0; i < 4; ++i) {
        const float reach = i == 0 ? 0.1f : 3.0f;
        Vec2 uv[3];
        for (Vec2& corner : uv) corner = (random.two() - Vec2(0.5f)) * reach;
        const test::Mean truth = c.truth(uv, 200000, static_cast<uint64_t>(i));
        EXPECT_NEAR(c.mean(uv), truth.value(), 4.6 * truth.error() + 2e-4 * truth.value())
            << "nearest " << nearest << " wrap " << static_cast<int>(wrap) << " "
            << i;  // the dither: 2^-13 texels
      }
    }
}

TEST(EmissionMap, WholeImageIsItsMean) {
  const Case c = with(noise(64, 64, 3));
  double mean = 0;
  Random random(3);
  for (int i = 0; i < 64 * 64; ++i)
    mean += random.one() < 0.8f ? 0.0 : static_cast<double>(10 * random.one());
  mean /= 64 * 64;
  const double lower = c.mean({{0, 0}, {1, 0}, {1, 1}}), upper = c.mean({{0, 0}, {1, 1}, {0, 1}});
  EXPECT_NEAR(0.5 * (lower + upper), mean, 1e-5 * mean);  // texels in floats
  // Beyond the budget: halved images, with the same mean over whole repeats.
  const double many =
      c.mean({{0, 0}, {40, 0}, {40, 40}}, 1 << 20) + c.mean({{0, 0}, {40, 40}, {0, 40}}, 1 << 20);
  EXPECT_NEAR(0.5 * many, mean, 1e-5 * mean);
  EXPECT_NEAR(c.mean({{-9000, -9000}, {9000, -9000}, {0, 9000}}), mean, 1e-5 * mean);
}

TEST(EmissionMap, OneTexelIsNeverMissed) {
  std::vector<float> texels(256 * 256, 0.0f);
  texels[100 * 256 + 37] = 5.0f;
  const Case c = with(test::gray_texture(256, 256, texels));
  const Vec2 whole[3] = {{0, 0}, {1, 0}, {0, 1}};
  EXPECT_NEAR(c.mean(whole), 5.0 / 256 / 256 * 2, 1e-9);
  EXPECT_GT(c.mean(whole, 1 << 20), 0) << "over halved images too";
  // A sliver that ends between the texel's centre and the next one's.
  const float x = 37.9f / 256, y = 100.5f / 256;
  EXPECT_GT(c.mean({{x, y}, {0.9f, y}, {0.9f, y + 1e-3f}}), 0);
  EXPECT_EQ(c.mean({{0.3f, 0}, {0.9f, 0}, {0.9f, 0.1f}}), 0) << "and dark is dark";
  // No area in the texture: a point and a line, on the texel and beside it.
  const Vec2 on(37.5f / 256, 100.5f / 256), off(0.9f, 0.9f);
  EXPECT_NEAR(c.mean({on, on, on}), 5, 1e-5);
  EXPECT_EQ(c.mean({off, off, off}), 0);
  EXPECT_GT(c.mean({off, on, off}), 0);
}

TEST(EmissionMap, VertexColoursAndNonsense) {
  Attributes a[3];
  a[0].color = Vec4(3, 3, 3, 1), a[1].color = Vec4(0, 0, 0, 1), a[2].color = Vec4(0, 0, 0, 1);
  EXPECT_NEAR(EmissionMap({Vec3(2.0f), nullptr, true}, 1).mean(a), 2, 1e-6);
  EXPECT_NEAR(EmissionMap({Vec3(2.0f), nullptr, false}, 1).mean(a), 2, 1e-6);
  const Case c = with(noise(8, 8, 4));
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(std::isfinite(c.mean({{nan, 0}, {inf, 1}, {0, -inf}})));
  EXPECT_TRUE(std::isfinite(c.mean({{1e30f, 0}, {3e4f, 1}, {0, -1e9f}})));
}

TEST(EmissionMap, PowerSteersTheChoice) {
  // Two quads side by side; the texture shines on the left half of each only at one texel in 16.
  test::SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.quad({-9, 0, -9}, {0, 0, 1}, {1, 0, 0});
  std::vector<float> texels(16 * 16, 0.0f);
  for (size_t i = 0; i < texels.size(); i += 16) texels[i] = 1.0f;
  Texture t = test::gray_texture(16, 16, texels);
  t.wrap_s = t.wrap_t = Wrap::kClamp;
  t.nearest = true;
  const uint32_t shines = test::emissive_texture(m, t);
  test::textured_quad(m, {-1, 5, 0}, {0, 0, 1}, {-1, 0, 0}, shines);  // faces down?
  test::textured_quad(m, {0, 5, 0}, {1, 0, 0}, {0, 0, 1}, m.lambert(Vec3(0), Vec3(1)));
  const test::LitScene scene = test::light_up(m.take(), LightChoice::kPower);
  const LocalLights& lights = scene.lights.local;
  ASSERT_EQ(lights.size(), 4u);
  const auto chance = [&](uint32_t light) { return lights.probability_of(light, Vec3(0), Vec3(0, 1, 0)); };
  EXPECT_NEAR(chance(0) + chance(1), 1.0 / 17, 1e-6);
  EXPECT_NEAR(chance(2), chance(3), 1e-6);
}

}  // namespace
}  // namespace kiln
