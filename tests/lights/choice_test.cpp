// Which light: the tree's choice against its probability, its bounds, and the other ways of choosing.
#include <map>

#include "tests/lights/light_scenes.h"
#include "tests/lights/statistics.h"

namespace kiln {
namespace {

using test::Random;

// Lamps, spots and panels of strengths over eight decades.
std::vector<LightBounds> random_lights(size_t n, uint64_t seed, float low, float high) {
  Random random(seed);
  std::vector<LightBounds> lights(n);
  for (size_t i = 0; i < n; ++i) {
    LightBounds& l = lights[i];
    l.centre = random.in_box(Vec3(-9, low, -9), Vec3(9, high, 9));
    l.strength = std::pow(10.0, 8 * random.one());
    if (i % 3 == 0) continue;
    l.axis = random.direction();
    l.cos_normals = i % 3 == 1 ? 1.0 : 0.9;
    l.cos_emission = i % 3 == 1 ? 0.0 : 0.8;
    l.radius = i % 3 == 1 ? 0.3f * random.one() : 0.0f;
    l.two_sided = i % 6 == 1;
  }
  return lights;
}

TEST(LightTree, IsChosenWithTheProbabilityStated) {
  for (const size_t n : {2, 3, 4, 5, 17, 2000}) {
    const LightTree tree(random_lights(n, n, -3, 3));
    Random random(n + 1);
    const Vec3 p = random.in_box(Vec3(-9), Vec3(9)), normal = random.direction();
    constexpr int kDraws = 200000;
    std::vector<double> counts(n + 1, 0), expected(n + 1, kDraws);
    for (int i = 0; i < kDraws; ++i) {
      const auto choice = tree.choose(p, normal, random.one());
      counts[choice.probability > 0 ? choice.light : n] += 1;
      if (choice.probability > 0)
        ASSERT_EQ(choice.probability, tree.probability(choice.light, p, normal)) << "to the last bit";
    }
    for (size_t i = 0; i < n; ++i) {
      expected[i] = kDraws * static_cast<double>(tree.probability(static_cast<uint32_t>(i), p, normal));
      expected[n] -= expected[i];  // the rest: ways that turned out dark
    }
    if (expected[n] < 1e-5 * kDraws) expected[n] = 0;  // rounding of the sum
    EXPECT_EQ(test::chi_square(expected, counts), "") << n;
  }
}

TEST(LightTree, ProbabilitiesSumToOne) {
  for (const size_t n : {1, 6, 64, 1000, 100000}) {
    // Lamps above a floor: none is excluded, so no way down is dark.
    std::vector<LightBounds> lights = random_lights(n, n, 1, 3);
    for (LightBounds& l : lights) l.cos_normals = -1, l.radius = 0, l.two_sided = false;
    const LightTree tree(lights);
    double sum = 0;
    for (size_t i = 0; i < n; ++i) {
      const float chance = tree.probability(static_cast<uint32_t>(i), Vec3(1, 0, 2), Vec3(0, 1, 0));
      EXPECT_GT(chance, 0.0f);
      sum += static_cast<double>(chance);
    }
    EXPECT_NEAR(sum, 1, 1e-6) << n;  // each is rounded to 2^-24 of itself
  }
}

TEST(LightTree, TellsApartWhatIsFinerThanTheNumber) {
  // A strong lamp, and 500 weak ones that have half of one of the 2^23 cells of u between them: without finer
  // bits that cell would find them always or never, and then always the same.
  std::vector<LightBounds> lights(501);
  for (size_t i = 0; i < lights.size(); ++i) {
    lights[i].centre = Vec3(1000, 0, static_cast<float>(i));
    lights[i].strength = i == 0 ? 1 : 0.5 * 0x1p-23 / 500;
  }
  const LightTree tree(lights);
  double truth = 0, weak = 0;
  for (uint32_t i = 1; i < lights.size(); ++i)
    truth += 0x1p23 * static_cast<double>(tree.probability(i, Vec3(0), Vec3(1, 0, 0)));
  ASSERT_GT(truth, 0.3);
  ASSERT_LT(truth, 0.7);
  std::map<uint32_t, int> found;
  constexpr int kDraws = 20000;
  Random random(5);
  for (int i = 0; i < kDraws; ++i) {
    const Vec3 p = random.in_box(Vec3(-0.01f), Vec3(0.01f));
    for (const float u : {0x1p-24f, 1 - 0x1p-24f}) {  // the strong lamp is at one of the ends
      const uint32_t light = tree.choose(p, Vec3(1, 0, 0), u).light;
      if (light != 0) ++weak, ++found[light];
    }
  }
  EXPECT_NEAR(weak / kDraws, truth, 4.6 * 0.5 / std::sqrt(kDraws));
  EXPECT_GT(found.size(), 450u);
}

// What a light of the scene gives p at most, found without the tree.
TEST(LightTree, WhatShinesCanBeChosen) {
  const test::LitScene scene = test::light_up(test::mixed_lights(40, 3, Vec3(-5), Vec3(5)));
  const test::LitScene all =
      test::light_up(test::mixed_lights(40, 3, Vec3(-5), Vec3(5)), LightChoice::kUniform);
  const LocalLights& uniform = all.lights.local;
  const auto count = static_cast<float>(uniform.size());
  Random random(4);
  size_t shining = 0, excluded = 0;
  for (int i = 0; i < 100000; ++i) {
    const Vec3 p = random.in_box(Vec3(-6), Vec3(6)), n = random.direction();
    const auto light = static_cast<uint32_t>(random.one() * count);
    const LightSample s =
        uniform.sample(*all.surfaces, p, n, (static_cast<float>(light) + 0.5f) / count, random.two());
    if (!(max_component(s.weight) > 0.0f) || dot(s.direction, n) <= 0.0f) {
      excluded += scene.lights.local.probability_of(light, p, n) == 0.0f;
      continue;
    }
    ++shining;
    ASSERT_GT(scene.lights.local.probability_of(light, p, n), 0.0f) << light << " at " << i;
  }
  EXPECT_GT(shining, 10000u);
  EXPECT_GT(excluded, 10000u) << "bounds that exclude nothing would pass";
}

TEST(LightTree, SurvivesExtremes) {
  // Strengths over 90 decades, all in one place, and receivers there too.
  std::vector<LightBounds> lights(100);
  for (size_t i = 0; i < lights.size(); ++i) {
    lights[i].centre = i < 50 ? Vec3(1, 2, 3) : Vec3(1e15f, 0, 0);
    lights[i].strength = std::pow(10.0, static_cast<double>(i % 50) * 1.8 - 45);
  }
  const LightTree tree(lights);
  for (const Vec3& p : {Vec3(1, 2, 3), Vec3(0), Vec3(-1e15f, 0, 0)}) {
    double sum = 0;
    for (uint32_t i = 0; i < lights.size(); ++i) {
      const float chance = tree.probability(i, p, Vec3(1, 0, 0));
      ASSERT_TRUE(chance >= 0.0f && chance <= 1.0f);
      sum += static_cast<double>(chance);
    }
    EXPECT_NEAR(sum, 1, 1e-5);
    for (float u = 0x1p-24f; u < 1; u += 0.01f) {
      const auto choice = tree.choose(p, Vec3(1, 0, 0), u);
      EXPECT_GT(choice.probability, 0.0f);
    }
  }
  EXPECT_EQ(LightTree().choose(Vec3(0), Vec3(0, 1, 0), 0.5f).probability, 0.0f);
}

// Tree, power and uniform choice find the same irradiance from all kinds of lights together.
TEST(LightChoice, AllAgree) {
  const Vec3 low(-3, 1, -3), high(3, 3, 3), n(0, 1, 0);
  std::map<LightChoice, test::LitScene> scenes;
  for (const LightChoice choice : {LightChoice::kTree, LightChoice::kPower, LightChoice::kUniform})
    scenes.emplace(choice, test::light_up(test::mixed_lights(6, 8, low, high), choice));
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(2, 2, -1)}) {
    std::map<LightChoice, test::Mean> means;
    for (auto& [choice, scene] : scenes) {
      Random random(9);
      for (int i = 0; i < 400000; ++i) {
        const float u = random.one();
        const LightSample s = scene.lights.local.sample(*scene.surfaces, p, n, u, random.two());
        means[choice].add(luminance(s.weight) * std::max(0.0f, dot(s.direction, n)));
      }
    }
    const test::Mean& tree = means[LightChoice::kTree];
    for (const LightChoice other : {LightChoice::kPower, LightChoice::kUniform}) {
      const double error = std::hypot(tree.error(), means[other].error());
      EXPECT_NEAR(tree.value(), means[other].value(), 4.6 * error);
      EXPECT_LT(tree.error(), means[other].error()) << "the tree is there for less noise";
    }
  }
}

}  // namespace
}  // namespace kiln
