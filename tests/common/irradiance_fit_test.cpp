// Fits of irradiance by low polynomials against brute force.
#include "common/responses/irradiance_fit.h"

#include <gtest/gtest.h>

#include "common/responses/receiver_frame.h"
#include "tests/common/random_light.h"

namespace kiln {
namespace {

// The squared error of a fit over normals with their weights, for light from (s, 0, c).
struct Truth {
  Truth(const FitDomain& domain, double c_) : c(c_), s(std::sqrt(1 - c_ * c_)) {
    constexpr int kNormals = 40000;
    for (int i = 0; i < kNormals; ++i) {
      const Vec3 m = test::on_cap((i + 0.5) / kNormals, 0.61803398875 * i, -1);
      weight.push_back(m.z > domain.lowest ? 1 : domain.outside);
      normal.push_back(m);
    }
  }
  double error(const QuadraticFit& f) const {
    double sum = 0;
    for (size_t i = 0; i < normal.size(); ++i) {
      const double x = normal[i].x, z = normal[i].z;
      const double fitted = f.level + z * (f.along + z * f.along2) + x * s * (f.across + z * f.across_z) +
                            (2 * x * x + z * z - 1) * s * s * f.across2;
      // x is the tangential part along the light; the part across it enters by x^2 + y^2 + z^2 = 1.
      sum += weight[i] * std::pow(fitted - std::max(0.0, c * z + s * x), 2);
    }
    return sum / static_cast<double>(normal.size());
  }
  double c, s;
  std::vector<double> weight;
  std::vector<Vec3> normal;
};

// No fit nearby is better, among those that keep E(n) where it is asked for.
TEST(IrradianceFit, IsLeastSquares) {
  for (const FitDomain& domain :
       {FitDomain{0.5, 0, true, false, false}, FitDomain{0.5, 0.02, true, true, true},
        FitDomain{0, 0, false, false, false}, FitDomain{0.5, 0.02, true, false, false}}) {
    const FitTable fit(domain);
    for (const double c : {-0.95, -0.5, -0.1, 0.0, 0.3, 0.707, 0.9, 0.999}) {
      const Truth truth(domain, c);
      const QuadraticFit best = fit(static_cast<float>(c));
      if (domain.is_exact) EXPECT_NEAR(best.level + best.along + best.along2, std::max(0.0, c), 1e-7) << c;
      const double least = truth.error(best);
      // Coefficients are right to 1e-4, which lowers no error by more than the square of that.
      for (const double step : {-0.02, 0.02})
        for (int k = 0; k < 6; ++k) {
          QuadraticFit other = best;
          double* const each[] = {&other.level,  &other.along,    &other.along2,
                                  &other.across, &other.across_z, &other.across2};
          if ((k == 2 && !domain.along2) || (k == 4 && !domain.across_z)) continue;
          *each[k] += step;
          if (domain.is_exact && (k == 1 || k == 2)) other.level -= step;
          if (domain.is_exact && k == 0) other.along -= step;
          EXPECT_GT(truth.error(other), least - 1e-8) << c << " coefficient " << k << " " << step;
        }
    }
  }
}

// A quadratic is all there is where every normal that counts sees the light.
TEST(IrradianceFit, OfLightThatTheWholeCapSees) {
  const FitTable fit({0.5, 0, true, true, true});
  const QuadraticFit q = fit(0.95f);
  EXPECT_NEAR(q.along, 0.95, 1e-4);
  EXPECT_NEAR(q.across, 1.0, 1e-4);
  for (const double none : {q.level, q.along2, q.across_z, q.across2}) EXPECT_NEAR(none, 0.0, 1e-4);
}

TEST(IrradianceFit, TableIsCloseToWhatItHolds) {
  for (const FitDomain& domain :
       {FitDomain{0.5, 0.02, true, true, true}, FitDomain{0, 0, false, false, false}}) {
    const FitTable fit(domain);
    for (int i = 0; i < 4001; ++i) {
      const double c = -1 + 2.0 * i / 4000;
      const QuadraticFit a = fit(static_cast<float>(c)), b = irradiance_fit(domain, c);
      const double s = std::sqrt(std::max(0.0, 1 - c * c));
      EXPECT_NEAR(a.along, b.along, 1e-4) << c;
      EXPECT_NEAR(a.along2, b.along2, 1e-4) << c;
      EXPECT_NEAR(a.across * s, b.across * s, 1e-4) << c;
      EXPECT_NEAR(a.across_z * s, b.across_z * s, 1e-4) << c;
      EXPECT_NEAR(a.across2 * s * s, b.across2 * s * s, 1e-4) << c;
    }
  }
}

TEST(ReceiverFrame, IsAFrameThatTurnsSlowly) {
  for (int i = 0; i < 2000; ++i) {
    const Vec3 n = test::on_cap((i + 0.5) / 2000, 0.61803398875 * i, -1);
    const ReceiverFrame f(n);
    // 1 + q.n is a difference of floats: what rounding does grows by its inverse.
    const double rounding = 4e-7 / std::max(1e-4, 1 + double{dot(n, Vec3(2.0f / 7, 3.0f / 7, 6.0f / 7))});
    EXPECT_NEAR(length(f.x), 1, rounding);
    EXPECT_NEAR(length(f.y), 1, rounding);
    EXPECT_NEAR(dot(f.x, f.y), 0, rounding);
    EXPECT_NEAR(dot(f.x, f.n), 0, rounding);
    EXPECT_NEAR(length(cross(f.x, f.y) - f.n), 0, 2 * rounding);
  }
  // Normals of walls and floors with noise in a zero: the frame stays.
  for (const Vec3 axis :
       {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(-1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, -1)})
    for (const Vec3 noise : {Vec3(1e-6f, -1e-6f, 1e-6f), Vec3(-1e-6f, 1e-6f, -1e-6f)}) {
      EXPECT_LT(length(ReceiverFrame(normalize_or(axis + noise, axis)).x - ReceiverFrame(axis).x), 2e-5f);
    }
}

}  // namespace
}  // namespace kiln
