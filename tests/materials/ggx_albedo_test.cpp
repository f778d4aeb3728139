// The tables of the GGX layer's albedo against plain quadrature over directions, and their means against
// their own interpolants.
#include "worker/materials/ggx_albedo.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kiln {
namespace {

struct Integrals {
  double f0 = 0, f90 = 0, fifth_f0 = 0, fifth_f90 = 0;
};

// An independent transcription of Heitz 2014 (height-correlated Smith), integrated over the half vector's
// slope in polar coordinates: density of normals, not of visible ones.
Integrals integrate(double cos, double alpha) {
  const auto lambda = [&](double z) {
    return 0.5 * (std::sqrt(1 + alpha * alpha * (1 - z * z) / (z * z)) - 1);
  };
  const double so = std::sqrt(1 - cos * cos);
  const int heights = 1500, turns = 600;
  Integrals out;
  for (int a = 0; a < heights; ++a) {
    // tan^2 of the normal = alpha^2 u / (1 - u) has density D cos for uniform u; u = 1 - (1 - v)^2 resolves
    // the tail.
    const double v = (a + 0.5) / heights, rest = (1 - v) * (1 - v), u = 1 - rest;
    const double tan2 = alpha * alpha * u / rest, hz = 1 / std::sqrt(1 + tan2), hr = std::sqrt(1 - hz * hz);
    for (int b = 0; b < turns; ++b) {
      const double phi = M_PI * (b + 0.5) / turns;
      const double oh = so * hr * std::cos(phi) + cos * hz;
      const double zi = 2 * oh * hz - cos;
      if (!(oh > 0) || !(zi > 0)) continue;
      // f cos_i dwi = D G2 / (4 cos) x 4 (o.h) dwh, and D dwh = du / cos_h per turn
      const double weight = oh / (cos * hz * (1 + lambda(cos) + lambda(zi))) * 2 * (1 - v);
      const double rise = std::pow(1 - oh, 5), under = std::pow(1 - zi, 5);
      out.f0 += weight * (1 - rise);
      out.f90 += weight * rise;
      out.fifth_f0 += weight * (1 - rise) * under;
      out.fifth_f90 += weight * rise * under;
    }
  }
  const double n = double{heights} * turns;
  return {out.f0 / n, out.f90 / n, out.fifth_f0 / n, out.fifth_f90 / n};
}

TEST(GgxAlbedo, IsTheIntegralOfTheLobe) {
  // Widths on the rows and halfway between two; the bounds are those that ggx_albedo.h states.
  double worst = 0, worst_dielectric = 0;
  for (const double roughness : {0.1414, 0.15, 0.2, 0.3, 0.45, 0.7, 1.0})
    for (const double cos : {0.03, 0.06, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 1.0}) {
      const float alpha = ggx_alpha(static_cast<float>(roughness));
      const Integrals truth = integrate(cos, static_cast<double>(alpha));
      const GgxAlbedo table(alpha);
      const ByFresnel e = table.albedo(static_cast<float>(cos)), k = table.fifth(static_cast<float>(cos));
      const auto at = [&] { return testing::Message() << "roughness " << roughness << ", cosine " << cos; };
      EXPECT_NEAR(e.f0, truth.f0, 0.0015) << at();
      EXPECT_NEAR(e.f90, truth.f90, 0.0015) << at();
      EXPECT_NEAR(e.white(), truth.f0 + truth.f90, 0.0013) << at();
      EXPECT_NEAR(k.white(), truth.fifth_f0 + truth.fifth_f90, 0.0016) << at();
      worst = std::max(worst, std::abs(e.white() - truth.f0 - truth.f90));
      worst_dielectric =
          std::max(worst_dielectric, std::abs(e.of(0.04f, 1.0f) - 0.04 * truth.f0 - truth.f90));
    }
  std::printf("largest error of the albedo: F = 1 %.5f, F0 = 0.04 %.5f\n", worst, worst_dielectric);
}

// Means that others have computed (quadrature of single-scattering GGX, Schlick with F0 = 0.04, and F = 1).
TEST(GgxAlbedo, MeansAreThoseOfQuadrature) {
  const struct {
    float alpha;
    double dielectric, white;
  } truths[] = {{1.0f, 0.0190, 0.4091}, {0.25f, 0.0532, 0.8823}, {0.04f, 0.0811, 0.9935}};
  for (const auto& t : truths) {
    const ByFresnel mean = GgxAlbedo(t.alpha).means().plain.albedo;
    EXPECT_NEAR(mean.of(0.04f, 1.0f), t.dielectric, 3e-4) << t.alpha;  // of four digits, and of the table
    EXPECT_NEAR(mean.white(), t.white, 8e-4) << t.alpha;
  }
}

TEST(GgxAlbedo, MeansAreThoseOfTheInterpolant) {
  for (const float alpha : {0.02f, 0.031f, 0.4f, 1.0f}) {
    const GgxAlbedo table(alpha);
    const GgxAlbedo::Means means = table.means();
    const int n = 100000;
    double sum[4] = {};
    for (int i = 0; i < n; ++i) {
      const double cos = (i + 0.5) / n;
      const float c = static_cast<float>(cos);
      const double fifth = std::pow(1 - cos, 5), e = table.albedo(c).white(), k = table.fifth(c).white();
      sum[0] += 2 * cos * e / n;
      sum[1] += 2 * cos * k / n;
      sum[2] += 2 * cos * fifth * e / n;
      sum[3] += 2 * cos * fifth * k / n;
    }
    // 16 points on each of 40 cells: the midpoint rule errs by the second derivative / 24 x width^2 < 1e-5.
    EXPECT_NEAR(means.plain.albedo.white(), sum[0], 3e-5) << alpha;
    EXPECT_NEAR(means.plain.fifth.white(), sum[1], 3e-5) << alpha;
    EXPECT_NEAR(means.under_fifth.albedo.white(), sum[2], 3e-5) << alpha;
    EXPECT_NEAR(means.under_fifth.fifth.white(), sum[3], 3e-5) << alpha;
  }
}

}  // namespace
}  // namespace kiln
