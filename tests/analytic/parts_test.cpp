// What takes no part in light, against closed forms and against scenes without it: Instance::cast, ::reflect
// and
// ::receive.
#include <cmath>

#include "common/scene/prepared.h"
#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {
using test::SceneMaker;

// As workers are given it.
Scene sent(const Scene& scene) {
  ChunkStore chunks;
  const Digest id = write_scene(scene, chunks);
  Scene out = *read_scene(*chunks.find(id), [&](const Digest& d) { return chunks.find(d); });
  for (size_t i = 0; i < out.instances.size(); ++i) out.instances[i].receive = scene.instances[i].receive;
  return out;
}

std::vector<Vec3> light_of(const test::Bake& b, uint32_t instance) {
  std::vector<Vec3> out;
  for (const test::BakedTexel& t : b.texels)
    if (t.instance == instance) out.push_back(t.e);
  return out;
}

// A floor of 2 m under a sun and a sky, and a lid above all of it, seen by nobody else.
SceneMaker floor_and_lid(bool lid) {
  SceneMaker s;
  s.lambert(Vec3(0.5f));
  s.lambert(Vec3(0.8f));
  s.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0);
  if (lid) s.box({-3, 1, -3}, {3, 1.5f, 3}, false, 1);
  s.sun({0, 1, 0}, Vec3(2));
  s.environment(Vec3(1));
  return s;
}

TEST(Parts, WhatDoesNotCastLeavesLightAsWithoutIt) {
  const std::vector<Vec3> open = light_of(test::bake(floor_and_lid(false).take(), 4, 64), 0);
  Scene scene = floor_and_lid(true).take();
  for (size_t i = 1; i < scene.instances.size(); ++i) scene.instances[i].receive = false;
  const std::vector<Vec3> shut = light_of(test::bake(sent(scene), 4, 64), 0);
  for (size_t i = 1; i < scene.instances.size(); ++i) scene.instances[i].cast = false;
  const test::Bake b = test::bake(sent(scene), 4, 64);
  ASSERT_EQ(light_of(b, 0), open) << "bit for bit";
  ASSERT_EQ(shut.size(), open.size());
  for (size_t i = 0; i < open.size(); ++i) EXPECT_LT(shut[i].x, 0.8f * open[i].x) << "the lid shades it";
  EXPECT_EQ(b.texels.size(), open.size()) << "receive false has no texels";
}

// Sun on a facing surface and the sky's pi, of the upper side; below it what the floor reflects.
TEST(Parts, WhatDoesNotCastStillReceives) {
  Scene scene = floor_and_lid(true).take();
  for (size_t i = 1; i < scene.instances.size(); ++i) scene.instances[i].cast = false;
  const test::Bake b = test::bake(sent(scene), 2, 256);
  size_t above = 0;
  for (const test::BakedTexel& t : b.texels) {
    if (t.instance == 0 || t.ns.y < 0.9f) continue;
    ++above;
    EXPECT_NEAR(t.luminance, 2 + M_PI, 0.005 * (2 + M_PI));  // the promise of docs/testing.md
  }
  EXPECT_GT(above, 100u);
}

// A closed box with a lamp, one wall of which gives no light: as if that wall were painted black.
TEST(Parts, WhatDoesNotReflectIsBlack) {
  const auto room = [](bool painted) {
    SceneMaker s;
    s.lambert(Vec3(0.7f));
    const uint32_t black = s.lambert(Vec3(0));
    const uint32_t lamp = s.lambert(Vec3(0.7f), Vec3(3));
    s.quad({-1, -1, 1}, {2, 0, 0}, {0, 0, -2}, 0);
    s.quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, lamp);
    s.quad({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, painted ? black : 0);
    s.quad({-1, -1, 1}, {0, 0, -2}, {0, 2, 0}, 0);
    return s.take();
  };
  Scene scene = room(false);
  const std::vector<Vec3> plain = light_of(test::bake(scene, 4, 64), 0);
  scene.instances[2].reflect = false;
  const std::vector<Vec3> dark = light_of(test::bake(sent(scene), 4, 64), 0);
  EXPECT_EQ(dark, light_of(test::bake(room(true), 4, 64), 0)) << "bit for bit";
  EXPECT_NE(dark, plain);
  // The lamp itself: no light at all is left.
  scene = room(false);
  scene.instances[1].reflect = false;
  for (const Vec3& e : light_of(test::bake(sent(scene), 4, 16), 0)) EXPECT_EQ(e, Vec3(0));
}

// E below the middle of a square lamp of side 2 at height 1: radiance times Lambert's form factor
// (4 / sqrt 2) atan(1 / sqrt 2). Light sampling alone finds it where no path meets it.
TEST(Parts, ALampThatDoesNotCastShines) {
  SceneMaker s;
  s.lambert(Vec3(0.0f));
  const uint32_t lamp = s.lambert(Vec3(0), Vec3(5));
  s.quad({-0.01f, 0, 0.01f}, {0.02f, 0, 0}, {0, 0, -0.02f}, 0);
  s.quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, lamp);
  Scene scene = s.take();
  scene.instances[1].cast = false;
  scene.instances[1].receive = false;
  const test::Bake b = test::bake(sent(scene), 100, 65536);
  const double truth = 5 * 4 / std::sqrt(2.0) * std::atan(1 / std::sqrt(2.0));
  double sum = 0;
  for (const test::BakedTexel& t : b.texels) sum += t.luminance;
  ASSERT_FALSE(b.texels.empty());
  EXPECT_NEAR(sum / static_cast<double>(b.texels.size()), truth, 0.005 * truth);
}

}  // namespace
}  // namespace kiln
