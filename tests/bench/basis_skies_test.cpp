// The orders of bases under skies, with fewer directions than basis_table has.
#include "tests/bench/basis_skies.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kiln::test {
namespace {

constexpr int kDirections = 20000, kNormals = 150;

const SkyErrors& row(const std::vector<SkyErrors>& rows, std::string_view basis) {
  for (const SkyErrors& r : rows)
    if (r.basis == basis) return r;
  throw std::runtime_error("no such basis");
}

TEST(BasisSkies, DiceAndGaussiansInTheThesisOrder) {
  for (const Sky& sky : skies()) {
    const std::vector<SkyErrors> errors = sky_errors(sky, kDirections, kNormals);
    EXPECT_TRUE(keeps_order(sky, errors)) << sky.name;
    // More numbers of one kind say irradiance and wide reflections better.
    EXPECT_LT(row(errors, "sh_l4").lambert, row(errors, "sh_l2").lambert) << sky.name;
    EXPECT_LT(row(errors, "sh_l2").lambert, row(errors, "sh_l1").lambert) << sky.name;
    EXPECT_LT(row(errors, "ad12").lambert, row(errors, "ad9").lambert) << sky.name;
    EXPECT_LT(row(errors, "sh_l4").rough, row(errors, "sh_l2").rough) << sky.name;
    // The H-basis has six numbers where L1 has four and L2 nine.
    EXPECT_LT(row(errors, "h6").lambert, row(errors, "sh_l1").lambert) << sky.name;
    EXPECT_GT(row(errors, "h6").lambert, row(errors, "sh_l2").lambert) << sky.name;
    EXPECT_TRUE(std::isnan(row(errors, "h6").radiance));
  }
}

// A sky that the basis holds is shown without error: light of a cosine for SH, and none for what says more.
TEST(BasisSkies, NothingIsLostOfASmoothSky) {
  const Sky smooth{"smooth", [](const Vec3& d) { return 1 + 0.5f * d.x + 0.3f * d.z; }};
  const std::vector<SkyErrors> errors = sky_errors(smooth, kDirections, kNormals);
  for (const char* basis : {"sh_l1", "sh_l2", "sh_l4"}) {
    const SkyErrors& e = row(errors, basis);
    for (const double error : {e.radiance, e.lambert, e.rough, e.smooth}) EXPECT_LT(error, 2e-3) << basis;
  }
  EXPECT_LT(row(errors, "ad12").lambert, 0.002);  // of the fit's 0.0012 a lobe
}

// Rough surfaces show dice better than one lamp, and better than Gaussians but at sunset.
TEST(BasisSkies, ReflectionsOfRoughSurfaces) {
  for (const Sky& sky : skies()) {
    const std::vector<ReflectionErrors> errors = reflection_errors(sky, kDirections, 60);
    ASSERT_EQ(errors.size(), 5u);
    const bool is_sunset = std::string_view(sky.name) == "sunset";
    if (!is_sunset) {
      EXPECT_LT(errors[0].rough, errors[2].rough) << sky.name;
      EXPECT_LT(errors[0].rough, errors[4].rough) << sky.name;
    }
    EXPECT_LT(errors[0].rough, 0.55) << sky.name;
  }
}

}  // namespace
}  // namespace kiln::test
