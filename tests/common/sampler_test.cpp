// Properties that every sampler promises, on the very numbers that bakes read.
#include <bit>
#include <set>

#include "common/math/samplers.h"

namespace kiln {
namespace {

Vec2 draw(Sampler sampler, uint32_t texel, uint32_t sample, uint32_t dimension) {
  return SampleStream(5, texel, sample, sampler).pair(dimension);
}

class EachSampler : public testing::TestWithParam<Sampler> {};
INSTANTIATE_TEST_SUITE_P(All, EachSampler,
                         testing::Values(Sampler::kOwen, Sampler::kHalton, Sampler::kPmj02, Sampler::kRandom),
                         [](const auto& param) {
                           return std::string(sampler_names()[static_cast<size_t>(param.param)]);
                         });

TEST_P(EachSampler, StaysInsideTheUnitSquare) {
  for (uint32_t texel = 0; texel < 64; ++texel)
    for (uint32_t dimension : {0u, 1u, 7u, 8u, 400u})
      for (uint32_t i : {0u, 1u, 63u, 4095u, 4096u, 1u << 20, ~0u}) {
        const Vec2 u = draw(GetParam(), texel, i, dimension);
        EXPECT_TRUE(u.x > 0 && u.x < 1 && u.y > 0 && u.y < 1) << u.x << " " << u.y;
        EXPECT_EQ(u.x, SampleStream(5, texel, i, GetParam()).single(dimension));
      }
}

// Chi-square over 16 x 16 cells, one number of each of 2^14 texels (so that they are independent): 255
// degrees of freedom, mean 255, standard deviation sqrt(510). Five deviations are met by chance once in 10^6.
TEST_P(EachSampler, IsUniformOverTexels) {
  for (uint32_t dimension : {0u, 1u, 9u})
    for (uint32_t sample : {0u, 5u, 5000u}) {
      std::vector<double> count(256, 0);
      const uint32_t n = 1 << 14;
      for (uint32_t texel = 0; texel < n; ++texel) {
        const Vec2 u = draw(GetParam(), texel, sample, dimension);
        ++count[static_cast<size_t>(u.x * 16) * 16 + static_cast<size_t>(u.y * 16)];
      }
      double chi = 0;
      for (double c : count) chi += (c - n / 256.0) * (c - n / 256.0) / (n / 256.0);
      EXPECT_LT(chi, 255 + 5 * std::sqrt(510)) << dimension << " " << sample;
    }
}

// Correlation between numbers of different pairs of one texel, over its samples, averaged over texels. With
// independent numbers the mean of n products of centred numbers has the deviation (1/12)/sqrt(n).
TEST_P(EachSampler, DimensionsAreUncorrelated) {
  const uint32_t texels = 16, samples = 4096;
  for (uint32_t a = 0; a < 10; ++a)
    for (uint32_t b = a + 1; b < 12; ++b)
      for (int component = 0; component < 2; ++component) {
        double sum = 0;
        for (uint32_t texel = 0; texel < texels; ++texel)
          for (uint32_t i = 0; i < samples; ++i)
            sum += (draw(GetParam(), texel, i, a).x - 0.5) * (draw(GetParam(), texel, i, b)[component] - 0.5);
        EXPECT_LT(std::abs(sum / (texels * samples)), 5.0 / 12 / std::sqrt(texels * samples))
            << a << " " << b << " " << component;
      }
}

TEST_P(EachSampler, TexelsAndSeedsDiffer) {
  std::set<float> seen;
  for (uint32_t texel = 0; texel < 32; ++texel)
    for (uint64_t seed = 0; seed < 32; ++seed)
      seen.insert(SampleStream(seed, texel, 0, GetParam()).single(1));
  EXPECT_GT(seen.size(), 1000u);  // of 1024; 2^23 cells, so an accidental meeting or two is allowed
}

// Each elementary interval of area 2^-m holds one of any aligned run of 2^m samples within a table.
class NetSampler : public testing::TestWithParam<Sampler> {};
INSTANTIATE_TEST_SUITE_P(Nets, NetSampler, testing::Values(Sampler::kOwen, Sampler::kPmj02),
                         [](const auto& param) {
                           return std::string(sampler_names()[static_cast<size_t>(param.param)]);
                         });

bool is_net(Sampler sampler, uint32_t texel, uint32_t dimension, uint32_t first, int m) {
  for (int a = 0; a <= m; ++a) {
    std::set<std::pair<uint32_t, uint32_t>> cells;
    for (uint32_t i = 0; i < 1u << m; ++i) {
      const Vec2 u = draw(sampler, texel, first + i, dimension);
      cells.insert({static_cast<uint32_t>(u.x * static_cast<float>(1 << a)),
                    static_cast<uint32_t>(u.y * static_cast<float>(1 << (m - a)))});
    }
    if (cells.size() != size_t{1} << m) return false;
  }
  return true;
}

TEST_P(NetSampler, PrefixesAndAlignedRunsAreNets) {
  for (uint32_t texel : {0u, 7u, 123456u})
    for (uint32_t dimension : {0u, 1u, 9u, 200u}) {
      for (int m = 0; m <= 12; m += 3) EXPECT_TRUE(is_net(GetParam(), texel, dimension, 0, m)) << m;
      EXPECT_TRUE(is_net(GetParam(), texel, dimension, 64, 6));
      EXPECT_TRUE(is_net(GetParam(), texel, dimension, 1024 + 512, 9));
      EXPECT_TRUE(is_net(GetParam(), texel, dimension, 4096 * 5, 12));  // the fifth run through the table
    }
}

TEST(Random, IsNoNet) {
  EXPECT_FALSE(is_net(Sampler::kRandom, 0, 0, 0, 4));
  EXPECT_FALSE(is_net(Sampler::kHalton, 0, 1, 0, 6));
}

TEST(Halton, RadicalInverseByHand) {
  EXPECT_EQ(radical_inverse(0, 3), 0u);
  EXPECT_EQ(radical_inverse(1, 2), 0x80000000u);
  EXPECT_EQ(radical_inverse(6, 2), 0x60000000u);                                        // 110 to 0.011
  EXPECT_NEAR(radical_inverse(5, 3) / 0x1p32, 2.0 / 3 + 1.0 / 9, 1e-9);                 // 12 to 0.21
  EXPECT_NEAR(radical_inverse(123, 5) / 0x1p32, 3.0 / 5 + 4.0 / 25 + 4.0 / 125, 1e-9);  // 443 to 0.344
  EXPECT_LT(radical_inverse(~0u, 53) / 0x1p32, 1.0);
}

// n points of one base lie in n of n cells but for the carry: for n = base^k exactly one in each.
TEST(Halton, IsStratifiedInEachBase) {
  for (const auto& [n, component] : std::vector<std::pair<uint32_t, int>>{{256, 0}, {243, 1}}) {
    std::set<uint32_t> cells;
    const Vec2 shift = draw(Sampler::kHalton, 9, 0, 1);  // sample 0 is the shift itself
    for (uint32_t i = 0; i < n; ++i) {
      const double u = draw(Sampler::kHalton, 9, i, 1)[component] - double{shift[component]} + 1;
      cells.insert(static_cast<uint32_t>(std::floor(u * n + 0.5)) % n);
    }
    EXPECT_EQ(cells.size(), n);
  }
}

// Star discrepancy over boxes whose corners are the points' own coordinates, as a lower bound of the exact
// one.
double discrepancy(Sampler sampler, uint32_t dimension, uint32_t n) {
  std::vector<Vec2> points;
  for (uint32_t i = 0; i < n; ++i) points.push_back(draw(sampler, 2, i, dimension));
  double worst = 0;
  for (const Vec2& x : points)
    for (const Vec2& y : points) {
      double inside = 0;
      for (const Vec2& p : points) inside += p.x <= x.x && p.y <= y.y;
      worst = std::max(worst, std::abs(inside / n - double{x.x} * double{y.y}));
    }
  return worst;
}

// Bound of Halton's discrepancy in bases 2 and 3 (Niederreiter 1992, theorem 3.6: n D* < 2 + product of
// ((b - 1)/(2 ln b) ln n + (b + 1)/2)); a box shifted on the torus is the sum and difference of up to four
// boxes per axis pair with a corner in 0, hence a factor of nine at most.
TEST(Halton, HasLowDiscrepancy) {
  for (uint32_t n : {64u, 256u}) {
    const double ln = std::log(n);
    const double bound = (2 + (ln / (2 * std::log(2.0)) + 1.5) * (2 * ln / (2 * std::log(3.0)) + 2)) / n;
    const double halton = discrepancy(Sampler::kHalton, 1, n);
    EXPECT_LT(halton, 9 * bound);
    EXPECT_LT(halton, 0.5 * discrepancy(Sampler::kRandom, 1, n));
  }
}

TEST(Samplers, NamesAreFoundAndErrorsListThem) {
  for (uint32_t i = 0; i < kSamplers; ++i)
    EXPECT_EQ(static_cast<uint32_t>(*find_sampler(sampler_names()[i])), i);
  const auto none = find_sampler("sobol");
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("owen, halton, pmj02, random"), std::string::npos);
}

}  // namespace
}  // namespace kiln
