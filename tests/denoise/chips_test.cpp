// Chips: faces much smaller than a texel, beside surfaces of ordinary texels.
#include "tests/denoise/fields.h"

namespace kiln {
namespace {

constexpr float kWidth = 4;  // metres

// A wall of kWidth x 2 m, and chips of 4 mm at its right border: of one surface with it.
Scene chipped_wall(int chips) {
  test::Pieces pieces = test::Pieces().add(test::panel(kWidth, 2, 4, 2), Mat4x3(1));
  for (int i = 1; i <= chips; ++i)
    pieces.add(test::panel(0.004f, 0.004f, 1, 1), test::moved({kWidth, 0.4f * static_cast<float>(i), 0}));
  return pieces.scene;
}
bool on_chip(const Vec3& p) {
  return p.x > kWidth;
}

// Light and noise on the wall, none on its chips.
TexelStatistics lit_but_for_chips(const SiteGeometry& sites) {
  return test::noisy(
      sites, [](const Vec3& p) { return on_chip(p) ? 0.0 : 3.0; },
      [](const Vec3& p) { return on_chip(p) ? 0.0 : 0.6; }, 1);
}

// What is linked, a window could hold. The pole is as thick as a texel and a half.
TEST(SurfaceLinks, JoinTexelsOfLikeSizesAndNormals) {
  const Scene pole = test::Pieces().add(test::mantle(0.1f, 1, 8, 1), Mat4x3(1)).scene;
  for (const Scene& scene : {chipped_wall(1), pole}) {
    const test::MadeSurface s(scene, 8);
    ASSERT_GT(s.links.link.size(), s.sites.size());
    for (uint32_t i = 0; i < s.sites.size(); ++i)
      for (const uint32_t j : s.links.of(i)) {
        ASSERT_TRUE(sizes_alike(s.sites.texel_size[i], s.sites.texel_size[j]));
        ASSERT_GT(dot(s.sites.normal[i], s.sites.normal[j]), 0.6199f);  // 51.7 degrees
      }
  }
}

// No filter gives a chip the wall's light, so the wall's noise is not its own either.
TEST(Denoise, StatesNoNoiseOfAWallOnAChipOfIt) {
  const test::MadeSurface wall(chipped_wall(1), 8);
  const TexelStatistics s = lit_but_for_chips(wall.sites);
  const Denoised d = wall.denoise(s);
  size_t chips = 0;
  for (size_t i = 0; i < s.sites; ++i) {
    if (!on_chip(wall.sites.position[i])) continue;
    ++chips;
    EXPECT_EQ(d.luminance[i], 0);
    EXPECT_LT(d.standard_error[i], 1e-3);
  }
  EXPECT_GT(chips, 0u);
}

// The replicates of four chips differ by far more than their samples do, as those of cavities that see a
// cache: the wall's errors are what they are without that.
TEST(Denoise, StatesNoErrorOfACavityElsewhere) {
  const test::MadeSurface wall(chipped_wall(4), 8);
  const TexelStatistics s = lit_but_for_chips(wall.sites);
  TexelStatistics cavities = s;
  for (size_t i = 0; i < s.sites; ++i)
    if (on_chip(wall.sites.position[i])) cavities.luminance[0][i] = 1e-3f;
  const Denoised without = wall.denoise(s), with = wall.denoise(cavities);
  for (size_t i = 0; i < s.sites; ++i) {
    if (on_chip(wall.sites.position[i])) continue;
    // A chip counts as 16 in a mean over 129 sites or more, which is about 1: four add a quarter to the
    // error.
    EXPECT_NEAR(with.standard_error[i], without.standard_error[i], 0.25 * without.standard_error[i]);
  }
}

}  // namespace
}  // namespace kiln
