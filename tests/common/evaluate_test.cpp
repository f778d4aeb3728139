// What renderers do with sh_l1 (common/responses/evaluate.h), against quadrature over the sphere.
#include "common/responses/evaluate.h"

#include <functional>
#include <random>

#include "common/math/trig.h"
#include "common/responses/basis.h"

namespace kiln {
namespace {

constexpr double kPiD = 3.14159265358979323846;

// Mean over the sphere: midpoints in the cosine of the polar angle about +z, and in the azimuth.
double sphere_mean(const std::function<double(const Vec3&)>& f, int rows = 400, int columns = 64) {
  double sum = 0;
  for (int r = 0; r < rows; ++r) {
    const double z = -1 + 2 * (r + 0.5) / rows, s = std::sqrt(1 - z * z);
    for (int c = 0; c < columns; ++c) {
      const double a = 2 * kPiD * (c + 0.5) / columns;
      sum += f(Vec3(s * std::cos(a), s * std::sin(a), z));
    }
  }
  return sum / rows / columns;
}

TEST(NonlinearL1, KeepsTheMeanAndIsNeverNegative) {
  // Midpoints of q^p, p from 1 to 3, over 400 rows err by at most p (p - 1) / (24 x 400^2) of the integral:
  // 2e-6 with the factor 4; floats add about as much.
  for (const float a : {0.0f, 0.01f, 0.3f, 0.6f, 0.9f, 1.0f})
    for (const Vec3& axis : {Vec3(0, 0, 1), Vec3(0, 0, -1)}) {
      double least = 1;
      const double mean = sphere_mean([&](const Vec3& n) {
        const double e = sh_l1_irradiance_nonlinear(2.5f, axis * (2.5f * a), n);
        least = std::min(least, e);
        return e;
      });
      EXPECT_NEAR(mean / kPiD, 2.5, 2.5 * 5e-6) << a;
      EXPECT_GE(least, 0.0) << a;
    }
}

// First moment: mean over n of E/pi n.d is L0 2a (1 + 2a) / ((1 + a)(3 + 2a)); the linear one has 2a/3, and
// they agree to first order in a.
TEST(NonlinearL1, ItsFirstMomentIsTheStatedOne) {
  for (const float a : {0.001f, 0.2f, 0.5f, 1.0f}) {
    const double moment = sphere_mean(
        [&](const Vec3& n) { return sh_l1_irradiance_nonlinear(1.0f, Vec3(0, 0, a), n) * double{n.z}; });
    EXPECT_NEAR(moment / kPiD, 2.0 * a * (1 + 2.0 * a) / ((1 + a) * (3 + 2.0 * a)), 1e-5) << a;
  }
  const double linear =
      sphere_mean([](const Vec3& n) { return sh_l1_irradiance(1, Vec3(0, 0, 0.001f), n) * double{n.z}; });
  const double curved = sphere_mean(
      [](const Vec3& n) { return sh_l1_irradiance_nonlinear(1, Vec3(0, 0, 0.001f), n) * double{n.z}; });
  EXPECT_NEAR(curved / linear, 1.0,
              0.002);  // (1 + 2a)/((1 + a)(1 + 2a/3)) = 1 + a/3 + ...; and floats of 1e-7 / 6e-4
}

// Against the true irradiance of a lamp in one direction: L0 = |L1| = 1/(4 pi), E(n) = max(0, n.d).
TEST(NonlinearL1, ComesNearerToALampThanTheLinearForm) {
  const float l0 = 0.25f * kInvPi;
  double curved = 0, linear = 0;
  sphere_mean([&](const Vec3& n) {
    const double truth = std::max(0.0f, n.z);
    curved += std::pow(sh_l1_irradiance_nonlinear(l0, Vec3(0, 0, l0), n) - truth, 2);
    linear += std::pow(sh_l1_irradiance(l0, Vec3(0, 0, l0), n) - truth, 2);
    return 0.0;
  });
  EXPECT_LT(curved, 0.5 * linear);
  EXPECT_NEAR(sh_l1_irradiance_nonlinear(l0, Vec3(0, 0, l0), Vec3(0, 0, 1)), 1.0f, 1e-6f);  // 4 L0 pi
}

TEST(NonlinearL1, LimitsAreDefined) {
  const Vec3 n(0, 0, 1);
  EXPECT_EQ(sh_l1_irradiance_nonlinear(0, Vec3(0, 0, 1), n), 0.0f);
  EXPECT_EQ(sh_l1_irradiance_nonlinear(-1, Vec3(0, 0, 1), n), 0.0f);
  EXPECT_EQ(sh_l1_irradiance_nonlinear(std::nanf(""), Vec3(0, 0, 1), n), 0.0f);
  EXPECT_EQ(sh_l1_irradiance_nonlinear(2, Vec3(0.0f), n), 2 * kPi);
  const Vec3 one(0, 0.6f, 0.8f);
  EXPECT_NEAR(sh_l1_irradiance_nonlinear(2, one * 2.0f, n), sh_l1_irradiance_nonlinear(2, one * 50.0f, n),
              1e-5f);
  EXPECT_EQ(sh_l1_irradiance_nonlinear(2, Vec3(0, 0, -4), n), 0.0f);
  EXPECT_NEAR(sh_l1_irradiance_nonlinear(2, Vec3(0, 0, 1e-7f), n), 2 * kPi, 1e-5f);
}

TEST(DominantLight, IsTheMeanOverColours) {
  ShL1Texel t{Vec3(1, 2, 3), {Vec3(0.5f, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1.5f)}};
  const DominantLight d = dominant_light(t, Vec3(0, 0, 1));
  const Vec3 sum(0.5f, 1, 1.5f);
  EXPECT_NEAR(length(d.direction - sum / length(sum)), 0, 1e-6f);
  EXPECT_NEAR(d.focus, length(sum) / 6, 1e-6f);
  t.l0 = Vec3(0.0f);
  EXPECT_EQ(dominant_light(t, Vec3(0, 0, 1)).direction, Vec3(0, 0, 1));
  EXPECT_EQ(dominant_light(t, Vec3(0, 0, 1)).focus, 0.0f);
  EXPECT_EQ(softened_roughness(0.3f, 1), 0.3f);
  EXPECT_EQ(softened_roughness(0.3f, 0), 1.0f);
}

// The lobe against GGX written anew: D G2 F / (4 cos cos) with Smith's height-correlated G2, in double.
double plain_ggx(double nl, double nv, double nh, double vh, double alpha, double f0) {
  const auto lambda = [&](double c) {
    return (std::sqrt(1 + alpha * alpha * (1 - c * c) / (c * c)) - 1) / 2;
  };
  const double d = alpha * alpha / (kPiD * std::pow(nh * nh * (alpha * alpha - 1) + 1, 2));
  return (f0 + (1 - f0) * std::pow(1 - vh, 5)) * d / (1 + lambda(nl) + lambda(nv)) / (4 * nl * nv);
}

TEST(SpecularFromL1, IsALampReflectedByGgx) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> number(0, 1);
  int lit = 0;
  for (int i = 0; i < 500; ++i) {
    const auto unit = [&] {
      return normalize_or(Vec3(number(random) - 0.5f, number(random) - 0.5f, number(random)), Vec3(0, 0, 1));
    };
    const Vec3 l = unit(), v = unit(), n(0, 0, 1), h = normalize_or(l + v, n);
    const float focus = 0.05f + 0.95f * number(random), roughness = 0.1f + 0.9f * number(random);
    const ShL1Texel t{Vec3(1.0f), {Vec3(l.x) * focus, Vec3(l.y) * focus, Vec3(l.z) * focus}};
    const double rough = softened_roughness(roughness, focus);
    const double expected =
        kPiD * (1 + 2 * focus) * l.z * plain_ggx(l.z, v.z, h.z, dot(v, h), rough * rough, 0.04);
    const Vec3 got = specular_from_l1(t, n, v, roughness, Vec3(0.04f));
    // Floats: d cancels down to alpha^2 (at least 1e-4) of numbers of 1, and is squared.
    EXPECT_NEAR(got.x, expected, expected * 4e-3 + 1e-7) << i;
    lit += got.x > 0;
  }
  EXPECT_GT(lit, 400);
}

TEST(SpecularFromL1, IsDarkBehindAndReciprocal) {
  const ShL1Texel above{Vec3(1.0f), {Vec3(0.0f), Vec3(0.0f), Vec3(0.8f)}};
  EXPECT_EQ(specular_from_l1(above, Vec3(0, 0, -1), Vec3(0, 0, -1), 0.5f, Vec3(0.04f)), Vec3(0.0f));
  EXPECT_EQ(specular_from_l1(above, Vec3(0, 0, 1), Vec3(0, 0, -1), 0.5f, Vec3(0.04f)), Vec3(0.0f));
  EXPECT_EQ(specular_from_l1({}, Vec3(0, 0, 1), Vec3(0, 0, 1), 0.5f, Vec3(0.04f)), Vec3(0.0f));
  // A white lobe gives back no more than arrives: at most pi (L0 + 2 L1) x F x D/(4 cos) <= finite at alpha
  // 1e-3.
  EXPECT_TRUE(is_finite(specular_from_l1(above, Vec3(0, 0, 1), Vec3(0, 0, 1), 0.0f, Vec3(1.0f))));
}

TEST(Power, StaysWithinItsStatedError) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> number(0, 1);
  for (int i = 0; i < 20000; ++i) {
    const auto x = static_cast<float>(std::pow(number(random), 6)),
               y = static_cast<float>(0.01 + 4 * number(random));
    const double truth = std::pow(double{x}, double{y});
    if (!(truth > 1e-37)) continue;
    EXPECT_NEAR(power(x, y), truth, truth * (2e-7 + 6e-8 * std::abs(y * std::log(double{x}))))
        << x << " " << y;
    EXPECT_NEAR(logarithm2(x), std::log2(double{x}), 1e-12 * (1 + std::abs(std::log2(double{x}))));
  }
  EXPECT_EQ(power(0, 2), 0.0f);
  EXPECT_EQ(power(1, 2), 1.0f);
  EXPECT_EQ(logarithm2(8), 3.0);
}

}  // namespace
}  // namespace kiln
