// A closed room of albedo 0.5 whose walls emit 1: E = pi (1 + 1/2 + 1/4 + ...).
#include <bit>

#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

Scene furnace(float albedo) {
  test::SceneMaker m;
  m.lambert(Vec3(albedo), Vec3(1.0f));
  m.box({0, 0, 0}, {2, 1.5f, 1}, true);
  return m.take();
}

void expect_e(uint32_t max_bounces, bool direct, bool indirect, double truth) {
  TransportSettings s;
  s.max_bounces = max_bounces;
  s.direct = direct;
  s.indirect = indirect;
  const auto b = test::bake(furnace(0.5f), 8, 512, s);
  for (uint32_t wall = 0; wall < 6; ++wall) {
    const auto c = test::compare(
        b, [&](uint32_t) { return truth; }, wall);
    EXPECT_NEAR(c.mean, truth, 0.005 * truth) << "wall " << wall;
    EXPECT_GE(c.share_within_3, 0.95) << "wall " << wall;
  }
}

TEST(Furnace, NoBounceIsPi) {
  expect_e(0, true, true, M_PI);
}
TEST(Furnace, OneBounce) {
  expect_e(1, true, true, 1.5 * M_PI);
}
TEST(Furnace, TwoBounces) {
  expect_e(2, true, true, 1.75 * M_PI);
}
TEST(Furnace, AllBounces) {
  expect_e(64, true, true, 2 * M_PI);
}
TEST(Furnace, DirectAlone) {
  expect_e(64, true, false, M_PI);
}
TEST(Furnace, IndirectAlone) {
  expect_e(64, false, true, M_PI);
}

TEST(Furnace, RouletteIsUnbiasedAtHighAlbedo) {
  // Albedo 0.9: E = 10 pi. A roulette that lost a percent a bounce would show here.
  TransportSettings s;
  s.max_bounces = 100000;
  const auto b = test::bake(furnace(0.9f), 6, 512, s);
  double mean = 0;
  for (const auto& t : b.texels) mean += t.luminance;
  EXPECT_NEAR(mean / b.texels.size(), 10 * M_PI, 0.005 * 10 * M_PI);
}

// Mean albedo of a GGX layer with F = 1 (single scattering), by plain quadrature over both directions:
// 1/pi int int D G2 / (4 cos cos) cos_i cos_o. An independent transcription of Heitz 2014.
double mean_albedo(double alpha) {
  const auto lambda = [&](double z) {
    return 0.5 * (std::sqrt(1 + alpha * alpha * (1 - z * z) / (z * z)) - 1);
  };
  double sum = 0;
  const int n = 64, turns = 128;
  for (int o = 0; o < n; ++o)
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < turns; ++k) {
        const double zo = (o + 0.5) / n, zi = (i + 0.5) / n, phi = M_PI * (k + 0.5) / turns;
        const double ro = std::sqrt(1 - zo * zo), ri = std::sqrt(1 - zi * zi);
        const DVec3 h = glm::normalize(DVec3(ro + ri * std::cos(phi), ri * std::sin(phi), zo + zi));
        const double t = 1 + (alpha * alpha - 1) * h.z * h.z;
        sum += alpha * alpha / (M_PI * t * t) / (1 + lambda(zo) + lambda(zi)) / 4;
      }
  return sum * (1.0 / n) * (2 * M_PI / n) / turns * 2;  // dz_o dz_i dphi, and 1/pi of 2 pi dz_o
}

TEST(Furnace, GlossyWallsKeepWhatGgxKeeps) {
  // Walls that emit 1 and reflect as metal of colour 1: by reciprocity the mean of one reflection over all
  // walls is pi times the mean albedo of the layer, which masking without multiple scattering keeps below 1.
  for (float roughness : {0.6f, 1.0f}) {
    test::SceneMaker m;
    const uint32_t metal = m.metallic_roughness(Vec3(1.0f), 1, roughness);
    m.scene().materials[metal].properties.push_back({"emission", {1, 1, 1}, "", {}});
    m.box({0, 0, 0}, {1, 1, 1}, true);
    TransportSettings s;
    s.max_bounces = 1;
    const auto b = test::bake(m.take(), 8, 1024, s);
    // By area: a texel that hangs over a wall's edge covers less of it, and E is not the same everywhere.
    double sum = 0, points = 0;
    for (const auto& t : b.texels) {
      const uint32_t* valid = &b.atlas.sites.words[b.atlas.sites.first_word[t.site]];
      const int n = std::popcount(valid[0]) + std::popcount(valid[1]);
      sum += n * t.luminance;
      points += n;
    }
    const double mean = sum / points;
    const double truth = M_PI * (1 + mean_albedo(roughness * roughness));
    EXPECT_NEAR(mean, truth, 0.002 * truth) << roughness;
  }
}

}  // namespace
}  // namespace kiln
