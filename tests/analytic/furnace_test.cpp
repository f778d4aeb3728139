// A closed room of albedo 0.5 whose walls emit 1: E = pi (1 + 1/2 + 1/4 + ...).
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

TEST(Furnace, WhiteMetalKeepsEverything) {
  // One reflection off walls that emit 1 and reflect as rough metal of colour 1: by reciprocity the mean over
  // all walls is pi (1 + mean albedo), and that is 1. A single scattering alone would give 1.80 pi and 1.41
  // pi.
  for (float roughness : {0.6f, 1.0f}) {
    test::SceneMaker m;
    const uint32_t metal = m.metallic_roughness(Vec3(1.0f), 1, roughness);
    m.scene().materials[metal].properties.push_back({"emission", {1, 1, 1}, "", {}});
    m.box({0, 0, 0}, {1, 1, 1}, true);
    TransportSettings s;
    s.max_bounces = 1;
    const auto b = test::bake(m.take(), 8, 1024, s);
    double mean = 0, area = 0;  // reciprocity speaks of areas: texels at the edges are half covered
    for (const auto& t : b.texels) {
      mean += t.coverage * t.luminance;
      area += t.coverage;
    }
    EXPECT_NEAR(mean / area, 2 * M_PI, 0.002 * 2 * M_PI) << roughness;
  }
}

}  // namespace
}  // namespace kiln
