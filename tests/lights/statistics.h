// Tests of samplers: chi-square, and means with their standard error.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/math/sequence.h"
#include "common/math/vec.h"

namespace kiln::test {

// Uniform numbers in (0, 1) without structure, the same on every machine.
class Random {
 public:
  explicit Random(uint64_t seed) : key_(mix_bits(seed)) {}
  float one() {
    return unit_float(static_cast<uint32_t>(mix_bits(key_ + 0x9e3779b97f4a7c15u * ++count_) >> 32));
  }
  Vec2 two() {
    const float x = one();
    return {x, one()};
  }
  Vec3 in_box(const Vec3& low, const Vec3& high) {
    const float x = one(), y = one();
    return low + (high - low) * Vec3(x, y, one());
  }
  Vec3 direction();

 private:
  uint64_t key_, count_ = 0;
};

// Pearson's test of counts against expected counts. Bins that expect less than 10 are pooled. Empty when the
// counts are plausible: significance 1e-4 over 40 tests together (Bonferroni), the quantile by Wilson &
// Hilferty 1931. Expected counts of 0 allow no count.
std::string chi_square(const std::vector<double>& expected, const std::vector<double>& counts);

// A mean and its standard error.
struct Mean {
  double sum = 0, squares = 0, n = 0;
  void add(double x) { sum += x, squares += x * x, ++n; }
  double value() const { return sum / n; }
  double error() const { return std::sqrt(std::max(0.0, squares / n - value() * value()) / n); }
};

// Within 4.6 standard errors (two-sided 1e-4 over about 20 such tests) and float rounding of the terms.
void expect_mean(const Mean& mean, double truth, const std::string& what);

}  // namespace kiln::test
