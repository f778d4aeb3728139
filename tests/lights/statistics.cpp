#include "tests/lights/statistics.h"

#include "common/math/warp.h"

namespace kiln::test {

Vec3 Random::direction() {
  const float z = 2 * one() - 1;
  return spherical(z, one());
}

std::string chi_square(const std::vector<double>& expected, const std::vector<double>& counts) {
  double statistic = 0, pooled_expected = 0, pooled = 0;
  int bins = 0;
  const auto add = [&](double e, double c) {
    statistic += (c - e) * (c - e) / e;
    ++bins;
  };
  for (size_t i = 0; i < expected.size(); ++i) {
    if (expected[i] == 0 && counts[i] > 0) return "bin " + std::to_string(i) + " cannot be met but was";
    if (expected[i] >= 10) {
      add(expected[i], counts[i]);
    } else {
      pooled_expected += expected[i], pooled += counts[i];
    }
  }
  if (pooled_expected > 0) add(pooled_expected, pooled);
  if (bins < 2) return bins == 1 ? "" : "no bins";
  constexpr double kQuantile = 4.5648;  // of the normal distribution at 1 - 1e-4 / 40
  const double k = bins - 1, a = 2 / (9 * k);
  const double limit = k * std::pow(1 - a + kQuantile * std::sqrt(a), 3);
  if (statistic <= limit) return "";
  return "chi-square " + std::to_string(statistic) + " above " + std::to_string(limit) + " with " +
         std::to_string(bins - 1) + " degrees of freedom";
}

void expect_mean(const Mean& mean, double truth, const std::string& what) {
  EXPECT_NEAR(mean.value(), truth, 4.6 * mean.error() + 1e-6 * std::abs(truth)) << what;
}

}  // namespace kiln::test
