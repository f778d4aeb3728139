// A basis in one file: what a roster asks of an entry.
#include "common/responses/basis_roster.h"

namespace kiln {
namespace {

// Light from above and from below.
struct TwoHalves {
  static constexpr std::array<std::string_view, 2> functions{"up", "down"};
  static constexpr std::array<bool, 2> is_signed{false, false};
  static constexpr std::array<uint32_t, 2> degree{0, 0};
  static BasisInfo info() { return {"two_halves", functions, is_signed, degree, false, "above and below"}; }
  static void evaluate(const Vec3& d, const Vec3&, float* f) {
    f[0] = d.y > 0 ? 1.0f : 0.0f;
    f[1] = 1.0f - f[0];
  }
};

TEST(BasisRoster, OneMoreIsOneStructAndOneEntry) {
  using WithOneMore = BasisRoster<ShL1, TwoHalves>;
  ASSERT_EQ(WithOneMore::all().size(), 2u);
  EXPECT_EQ(WithOneMore::all()[1].name, "two_halves");
  float f[kMaxBasisFunctions];
  WithOneMore::evaluate(1, Vec3(0, 1, 0), Vec3(0, 0, 1), f);
  EXPECT_EQ(f[0], 1.0f);
  EXPECT_EQ(f[1], 0.0f);
  // Both functions are of one degree: one band.
  const std::vector<BasisBand> bands = basis_bands(WithOneMore::all()[1]);
  ASSERT_EQ(bands.size(), 1u);
  EXPECT_EQ(bands[0].functions, (std::vector<size_t>{0, 1}));
}

// What every basis of the product must be, whoever adds it.
TEST(BasisRoster, EntriesAreWhole) {
  for (const BasisInfo& basis : basis_roster()) {
    EXPECT_EQ(basis.functions.size(), basis.is_signed.size()) << basis.name;
    EXPECT_EQ(basis.functions.size(), basis.degree.size()) << basis.name;
    EXPECT_FALSE(basis.about.empty()) << basis.name;
    EXPECT_TRUE(!basis.has_direction || basis.functions.size() >= 4) << basis.name;
    EXPECT_EQ(*find_basis(basis.name, basis.fit, basis.evaluator),
              static_cast<uint32_t>(&basis - basis_roster().data()));
    EXPECT_EQ(basis.irradiance == nullptr, basis.functions.empty()) << basis.name;
    EXPECT_TRUE(basis.is_bounded || basis.finish) << basis.name;
  }
}

}  // namespace
}  // namespace kiln
