#include <random>
#include <set>

#include "common/math/discrete.h"
#include "common/math/frame.h"
#include "common/math/sequence.h"
#include "common/math/trig.h"
#include "common/math/trig_double.h"
#include "common/math/warp.h"

namespace kiln {
namespace {

TEST(Trig, SinCosErrorAsStated) {
  double worst = 0;
  for (int i = -100000; i <= 200000; ++i) {
    const float t = i * 1e-5f;
    const SinCos a = sincos_turns(t);
    worst = std::max(worst, std::abs(a.sin - std::sin(2 * M_PI * double{t})));
    worst = std::max(worst, std::abs(a.cos - std::cos(2 * M_PI * double{t})));
  }
  EXPECT_LT(worst, 2e-7);
}

TEST(Trig, Atan2ErrorAsStated) {
  double worst = 0;
  for (int i = 0; i < 100000; ++i) {
    const double a = (i / 100000.0 - 0.5) * 2 * M_PI;
    const float x = static_cast<float>(std::cos(a)), y = static_cast<float>(std::sin(a));
    worst = std::max(worst, std::abs(atan2_turns(y, x) - std::atan2(double{y}, double{x}) / (2 * M_PI)));
  }
  EXPECT_LT(worst, 1e-7);
  EXPECT_EQ(atan2_turns(0, 0), 0.0f);
  EXPECT_NEAR(atan2_turns(0, -1), 0.5f, 1e-7);
}

TEST(Trig, InDouble) {
  double angle = 0, sine = 0, relative = 0;
  for (int i = 0; i <= 200000; ++i) {
    const double a = (i / 100000.0 - 1) * 4 * M_PI;
    const SinCosDouble s = sincos_radians(a);
    sine = std::max({sine, std::abs(s.sin - std::sin(a)), std::abs(s.cos - std::cos(a))});
    // Ratios over twenty decades, of both signs.
    const double y = std::sin(a) * std::pow(10.0, i % 21 - 10), x = std::abs(std::cos(a)),
                 t = std::atan2(y, x);
    angle = std::max(angle, std::abs(arctangent(y, x) - t));
    if (t != 0) relative = std::max(relative, std::abs(arctangent(y, x) / t - 1));
  }
  EXPECT_LT(sine, 1e-15);
  EXPECT_LT(angle, 5e-16);
  EXPECT_LT(relative, 1e-15);
  EXPECT_EQ(arctangent(0, 0), 0);
  EXPECT_EQ(arctangent(-1, 0), -M_PI / 2);
}

// The first 2^m points of every pair of dimensions form a (0, m, 2)-net in base 2: each elementary interval
// of area 2^-m holds exactly one point.
TEST(Sequence, PairsAreNets) {
  for (uint32_t texel : {0u, 7u, 123456u})
    for (uint32_t dimension : {0u, 1u, 9u})
      for (int m : {1, 4, 8})
        for (int a = 0; a <= m; ++a) {
          std::set<std::pair<uint32_t, uint32_t>> cells;
          for (uint32_t i = 0; i < 1u << m; ++i) {
            const Vec2 u = SampleStream(5, texel, i).pair(dimension);
            cells.insert(
                {static_cast<uint32_t>(u.x * (1 << a)), static_cast<uint32_t>(u.y * (1 << (m - a)))});
          }
          EXPECT_EQ(cells.size(), size_t{1} << m) << "m " << m << " a " << a;
        }
}

TEST(Sequence, DimensionsAndTexelsAreUncorrelated) {
  const int n = 4096;
  for (uint32_t d = 1; d < 6; ++d) {
    double sum = 0;
    for (int i = 0; i < n; ++i)
      sum += (SampleStream(1, 3, i).pair(0).x - 0.5) * (SampleStream(1, 3, i).pair(d).x - 0.5);
    // Standard deviation of the mean for independent pairs: (1/12)/sqrt(n).
    EXPECT_LT(std::abs(sum / n), 5.0 / 12 / std::sqrt(n));
  }
  double sum = 0;
  for (uint32_t t = 0; t < 4096; ++t)
    sum += (SampleStream(1, t, 0).pair(0).x - 0.5) * (SampleStream(1, t + 1, 0).pair(0).x - 0.5);
  EXPECT_LT(std::abs(sum / 4096), 5.0 / 12 / 64);
}

TEST(Sequence, NeverZeroAndNeverOne) {
  EXPECT_GT(unit_float(0), 0.0f);
  EXPECT_LT(unit_float(~0u), 1.0f);
  EXPECT_GT(mixed_hemisphere_pdf(mixed_hemisphere(Vec2(unit_float(0), 0.5f)).z), 0.0f);
}

TEST(Sequence, IntegratesBetterThanRandom) {
  // Mean absolute error of the integral of x y over many texels, against independent random numbers.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  double sobol = 0, plain = 0;
  const int n = 256, texels = 200;
  for (uint32_t t = 0; t < texels; ++t) {
    double a = 0, b = 0;
    for (int i = 0; i < n; ++i) {
      const Vec2 u = SampleStream(0, t, i).pair(2);
      a += u.x * u.y;
      b += uniform(random) * uniform(random);
    }
    sobol += std::abs(a / n - 0.25);
    plain += std::abs(b / n - 0.25);
  }
  EXPECT_LT(sobol, plain / 5);
}

TEST(Warp, MixedHemisphereMatchesItsDensity) {
  // Mean of 1/pdf over samples is the measure 2 pi; z has distribution function (z + z^2)/2.
  double measure = 0, below = 0;
  const int n = 1 << 16;
  for (int i = 0; i < n; ++i) {
    const Vec3 d = mixed_hemisphere(SampleStream(0, 0, i).pair(0));
    EXPECT_NEAR(length(d), 1.0f, 1e-6f);
    measure += 1.0 / mixed_hemisphere_pdf(d.z);
    below += d.z < 0.5f;
  }
  EXPECT_NEAR(measure / n, 2 * M_PI, 2e-3);
  EXPECT_NEAR(below / n, 0.375, 1e-3);
}

TEST(Warp, ConeStaysInTheConeEvenWhenTiny) {
  const float h = 1e-9f;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 d = uniform_cone(SampleStream(0, 0, i).pair(0), h);
    EXPECT_LE(d.x * d.x + d.y * d.y, 2.0f * h * 1.0001f);
  }
}

TEST(Discrete, ChosenAsOftenAsStated) {
  const DiscreteDistribution d({0, 1, 3, 0, 4, 0});
  std::vector<double> count(6, 0);
  const int n = 1 << 14;
  for (int i = 0; i < n; ++i) {
    const auto draw = d.sample((i + 0.5f) / n);
    ++count[draw.index];
    EXPECT_GE(draw.remainder, 0.0f);
    EXPECT_LT(draw.remainder, 1.0f);
  }
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(count[i] / n, d.probability(i), 1e-3);
  EXPECT_EQ(count[0] + count[3] + count[5], 0);
  EXPECT_EQ(d.sample(0x1.fffffep-1f).index, 4u);
}

TEST(Frame, IsOrthonormal) {
  for (int i = 0; i < 1000; ++i) {
    const Vec2 u = SampleStream(3, 0, i).pair(0);
    const Frame f(spherical(1 - 2 * u.x, u.y));
    EXPECT_NEAR(dot(f.x, f.y), 0, 1e-6);
    EXPECT_NEAR(dot(f.x, f.n), 0, 1e-6);
    EXPECT_NEAR(dot(cross(f.x, f.y), f.n), 1, 1e-5);
  }
  EXPECT_NEAR(Frame(Vec3(0, 0, -1)).n.z, -1, 0);
}

}  // namespace
}  // namespace kiln
