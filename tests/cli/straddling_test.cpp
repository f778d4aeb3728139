// Light does not come through the cache from texels that reach under a wall.
#include "coordinator/scene/imageio/exr.h"
#include "tests/analytic/scene_maker.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

// A closed box of thin walls on a floor in the sun; the floor alone has texels, 8 a metre, and none of its
// columns ends at a wall.
constexpr float kHalfFloor = 4, kInside[4] = {-1.02f, -0.56f, 1.10f, 0.82f};

Scene closed_box() {
  test::SceneMaker m;
  const uint32_t white = m.lambert(Vec3(0.7f));
  m.quad({-kHalfFloor, 0, -kHalfFloor}, {0, 0, 2 * kHalfFloor}, {2 * kHalfFloor, 0, 0}, white);
  m.box({-1.03f, 0.7f, -0.57f}, {1.11f, 0.74f, 0.83f}, false, white);
  m.box({-1.03f, 0, -0.57f}, {-1.02f, 0.7f, 0.83f}, false, white);
  m.box({1.10f, 0, -0.57f}, {1.11f, 0.7f, 0.83f}, false, white);
  m.box({-1.02f, 0, -0.57f}, {1.10f, 0.7f, -0.56f}, false, white);
  m.box({-1.02f, 0, 0.82f}, {1.10f, 0.7f, 0.83f}, false, white);
  Scene scene = m.take();
  for (size_t i = 1; i < scene.instances.size(); ++i) scene.instances[i].receive = false;
  return scene;
}

TEST(Straddling, NoLightComesIntoAClosedBoxThroughTheCache) {
  const test::TempDir dir;
  test::write_scene_glb(closed_box(), dir.path() / "box.glb");
  const auto result = test::run_kiln(
      dir.path(),
      "bake box.glb -o out --quiet --preview off --encode none --layout atlas --resolution 64x64 "
      "--environment 1,1,1 --sun 0.4,0.8,0.3:6,6,6 --denoise off --seams off --min-samples 256 "
      "--max-samples 256");
  ASSERT_EQ(result.exit_status, 0) << result.output;
  const auto e = read_exr(dir.path() / "out/irradiance.exr");
  ASSERT_TRUE(e);
  ASSERT_EQ(e->width, 64u);
  const float texel = 2 * kHalfFloor / 64;
  double lit = 0, brightest = 0;
  size_t within = 0;
  for (uint32_t y = 0; y < 64; ++y)
    for (uint32_t x = 0; x < 64; ++x) {
      const double value = e->plane("G")[size_t{y} * 64 + x];
      lit = std::max(lit, value);
      const float low[2] = {-kHalfFloor + static_cast<float>(y) * texel,
                            -kHalfFloor + static_cast<float>(x) * texel};
      // Wholly inside whichever way the axes of the image lie.
      const auto inside = [&](float a, float b) {
        return a > kInside[0] && a + texel < kInside[2] && b > kInside[1] && b + texel < kInside[3];
      };
      if (!inside(low[1], low[0]) || !inside(low[0], low[1])) continue;
      brightest = std::max(brightest, value);
      ++within;
    }
  EXPECT_GT(within, 20u);
  EXPECT_GT(lit, 6.0);
  EXPECT_EQ(brightest, 0.0);
}

}  // namespace
}  // namespace kiln
