// Lobes: Gram matrices, irradiance of a lobe, least squares, and the nearest point without negative numbers.
#include "common/responses/lobes.h"

#include <gtest/gtest.h>

#include "tests/common/random_light.h"

namespace kiln {
namespace {

using test::on_cap;

constexpr int kDirections = 200000;  // of the sphere
Vec3 direction(int i) {
  return on_cap((i + 0.5) / kDirections, 0.61803398875 * i, -1);
}
constexpr double kEach = 4 * M_PI / kDirections;

const LobeSet* const kSets[] = {&ad9_lobes(), &ad12_lobes(), &sg9_lobes(), &sg12_lobes()};

// Constants of the digest of Roughton 2019 for the icosahedron, there as means over the sphere.
TEST(Lobes, GramOfTheIcosahedron) {
  const LobeSet& set = ad12_lobes();
  for (size_t i = 0; i < 12; ++i)
    for (size_t j = 0; j < 12; ++j) {
      const double cosine = double{dot(set.axis[i], set.axis[j])}, mean = set.gram[i][j] / (4 * M_PI);
      const double known = cosine > 0.9    ? 0.0282222
                           : cosine > 0.0  ? 0.010393
                           : cosine > -0.9 ? 0.000629
                                           : 0.0;
      EXPECT_NEAR(mean, known, 2e-6) << cosine;
      const double inverse = cosine > 0.9    ? 69.344
                             : cosine > 0.0  ? -19.109
                             : cosine > -0.9 ? 11.419
                                             : -18.895;
      EXPECT_NEAR(double{set.inverse[i][j]} * 4 * M_PI, inverse, 0.02) << cosine;
    }
}

TEST(Lobes, GramMatricesAreTheIntegrals) {
  for (const LobeSet* set : kSets)
    for (size_t i = 0; i < set->count; i += 2)
      for (size_t j = i; j < set->count; j += 3) {
        double sum = 0;
        for (int k = 0; k < kDirections; ++k)
          sum += double{lobe_radiance(*set, dot(direction(k), set->axis[i]))} *
                 double{lobe_radiance(*set, dot(direction(k), set->axis[j]))};
        EXPECT_NEAR(set->gram[i][j], sum * kEach, 2e-4) << i << " " << j;
      }
}

// What engines evaluate against the integral: Roughton's fit misses by 0.0012 at most, Hill's by 0.0055.
TEST(Lobes, IrradianceOfALobe) {
  const double known[][2] = {{0, .258333},  {30, .224557},  {45, .186908},  {60, .142383},
                             {90, .059375}, {120, .013216}, {150, .000834}, {180, 0}};
  for (const auto& [degrees, truth] : known)
    EXPECT_NEAR(lobe_irradiance(ad12_lobes(), static_cast<float>(std::cos(degrees * M_PI / 180))), truth,
                1.25e-3)
        << degrees;
  for (const LobeSet* set : {&ad12_lobes(), &sg12_lobes()})
    for (int degrees = 0; degrees <= 180; degrees += 5) {
      const double a = degrees * M_PI / 180;
      const Vec3 n(std::sin(a), 0, std::cos(a));
      double sum = 0;
      for (int k = 0; k < kDirections; ++k)
        sum += double{lobe_radiance(*set, direction(k).z)} * std::max(0.0, double{dot(direction(k), n)});
      const float shown = lobe_irradiance(*set, static_cast<float>(std::cos(a)));
      EXPECT_NEAR(shown, sum * kEach / M_PI, set->is_dice ? 1.25e-3 : 5.5e-3) << degrees;
      EXPECT_GT(shown, 0.0f) << degrees;
    }
}

// Moments of light as a texel accumulates them solve the normal equations.
TEST(Lobes, ProjectionIsLeastSquares) {
  std::mt19937 random(5);
  for (const BasisInfo& basis : {basis_roster()[*find_basis("ad9")], basis_roster()[*find_basis("ad12")],
                                 basis_roster()[*find_basis("sg9")], basis_roster()[*find_basis("sg12")]}) {
    const LobeSet& set = basis.name == "ad9"    ? ad9_lobes()
                         : basis.name == "ad12" ? ad12_lobes()
                         : basis.name == "sg9"  ? sg9_lobes()
                                                : sg12_lobes();
    const Vec3 n(0, 0, 1);
    const test::Light light = test::random_light(random, n);
    const auto index = *find_basis(basis.name, "project");
    double b[kMaxLobes] = {}, moment[kMaxLobes] = {};
    for (const test::Light::Source& s : light.sources) {
      float f[kMaxBasisFunctions], local[kMaxBasisFunctions];
      evaluate_basis(index, s.direction, n, f);
      for (size_t i = 0; i < set.count; ++i) b[i] += s.irradiance * double{f[i]};
      // In the frame that the axes are in, found by evaluating a lobe's own solution back.
      for (size_t i = 0; i < set.count; ++i) {
        double sum = 0;
        for (size_t j = 0; j < set.count; ++j) sum += set.gram[i][j] * double{f[j]};
        local[i] = static_cast<float>(sum);
      }
      for (size_t i = 0; i < set.count; ++i) moment[i] += s.irradiance * double{local[i]};
    }
    double most = 0;
    for (const double m : std::span(moment, set.count)) most = std::max(most, std::abs(m));
    for (size_t i = 0; i < set.count; ++i) {
      double sum = 0;
      for (size_t j = 0; j < set.count; ++j) sum += set.gram[i][j] * b[j];
      EXPECT_NEAR(sum, moment[i], 1e-4 * most);
      EXPECT_GT(moment[i], -1e-4 * most) << "lobes are not negative";
    }
  }
}

double distance(const LobeSet& set, const double* a, const double* b) {
  double sum = 0;
  for (size_t i = 0; i < set.count; ++i)
    for (size_t j = 0; j < set.count; ++j) sum += (a[i] - b[i]) * set.metric[i][j] * (a[j] - b[j]);
  return sum;
}

// Against many points that obey the same conditions, and against stopping conditions.
TEST(Lobes, NearestIsNearest) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const LobeSet* set : kSets)
    for (int round = 0; round < 300; ++round) {
      double wish[kMaxLobes], b[kMaxLobes], weight[kMaxLobes];
      for (size_t i = 0; i < set->count; ++i) {
        wish[i] = b[i] = normal(random) + uniform(random);
        weight[i] = 0.01 + uniform(random);
      }
      const double e = 0.01 + 3 * uniform(random) * uniform(random);
      nearest_not_negative(*set, weight, e, b);
      double shown = 0, size = 0;
      for (size_t i = 0; i < set->count; ++i) {
        ASSERT_GE(b[i], 0.0);
        shown += weight[i] * b[i];
        size = std::max(size, b[i]);
      }
      ASSERT_NEAR(shown, e, 1e-9 * e);
      const double least = distance(*set, b, wish);
      // Light moved from one lobe to another keeps the condition.
      for (size_t from = 0; from < set->count; ++from)
        for (size_t to = 0; to < set->count; ++to)
          for (const double step : {1e-4, 1e-2}) {
            if (from == to || b[from] < step * size) continue;
            double other[kMaxLobes];
            std::copy(b, b + set->count, other);
            other[from] -= step * size;
            other[to] += step * size * weight[from] / weight[to];
            ASSERT_GE(distance(*set, other, wish), least * (1 - 1e-9)) << from << " to " << to;
          }
    }
}

}  // namespace
}  // namespace kiln
