// L1 fitted to the normals that a surface shows, against least squares by brute force.
#include "common/responses/sh_l1_fit.h"

#include <random>

#include "common/math/frame.h"
#include "common/responses/evaluate.h"
#include "tests/common/random_light.h"

namespace kiln {
namespace {
using test::Light;
using test::on_cap;
using test::random_light;

constexpr double kMu0 = 0.5;  // cosine of 60 degrees

// Moments of a basis, as a texel accumulates them.
template <class Basis>
std::array<float, 4> moments(const Light& light, const Vec3& n) {
  double sum[4] = {};
  for (const Light::Source& s : light.sources) {
    float f[4];
    Basis::evaluate(s.direction, n, f);
    for (int k = 0; k < 4; ++k) sum[k] += s.irradiance * double{f[k]};
  }
  return {float(sum[0]), float(sum[1]), float(sum[2]), float(sum[3])};
}

template <class Basis>
std::array<float, 4> finished(const Light& light, const Vec3& n) {
  std::array<float, 4> f = moments<Basis>(light, n);
  Basis::info().finish(static_cast<float>(light.irradiance(n)), n, f.data());
  return f;
}

// Mean square over the cap of a + b.m - E(m), by a fixed set of normals.
struct Cap {
  explicit Cap(const Light& light, const Vec3& n) {
    const Frame frame(n);
    constexpr int kNormals = 2000;
    for (int i = 0; i < kNormals; ++i) {
      m.push_back(frame.to_world(on_cap((i + 0.5) / kNormals, 0.61803398875 * i, kMu0)));
      e.push_back(light.irradiance(m.back()));
    }
  }
  double error(const float* f) const {
    double sum = 0;
    for (size_t i = 0; i < m.size(); ++i) sum += std::pow(ShL1::irradiance(f, m[i]) - e[i], 2);
    return sum / static_cast<double>(m.size());
  }
  std::vector<Vec3> m;
  std::vector<double> e;
};

// Where the whole cap sees the light b.m = d.m is exact; what no normal of it sees adds nothing.
TEST(ShL1Fit, OfOneDirection) {
  EXPECT_EQ(cap_fit(1.0f).along, 1.0f);
  EXPECT_EQ(cap_fit(0.9f).along, 0.9f);
  EXPECT_EQ(cap_fit(0.9f).across, 1.0f);
  EXPECT_EQ(cap_fit(-0.9f).along, 0.0f);
  // The table is continuous at its ends to the error it promises.
  EXPECT_NEAR(cap_fit(0.866f).along, 0.866f, 1e-4);
  EXPECT_NEAR(cap_fit(0.866f).across, 1.0f, 1e-4);
  EXPECT_NEAR(cap_fit(-0.866f).across, 0.0f, 1e-4);
  // Against least squares over 2 million normals between entries of the table.
  for (const double c : {0.85, 0.7131, 0.5, 0.2013, 0.0, -0.3007, -0.6, -0.83}) {
    const Vec3 d(std::sqrt(1 - c * c), 0, c);
    double along = 0, across = 0;
    constexpr int kRings = 1500, kAround = 1500;
    for (int i = 0; i < kRings; ++i)
      for (int j = 0; j < kAround; ++j) {
        const Vec3 m = on_cap((i + 0.5) / kRings, (j + 0.5) / kAround, kMu0);
        const double e = std::max(0.0, double{dot(m, d)}), rest = e - std::max(0.0, c);
        along += (m.z - 1.0) * rest;
        across += double{m.x} * e;
      }
    const double each = M_PI / (double{kRings} * kAround);  // solid angle of the cap over the normals
    const double k = M_PI / 12, b = 5 * M_PI / 24;          // integrals of (m.n - 1)^2, (m.x)^2
    EXPECT_NEAR(cap_fit(static_cast<float>(c)).along, along * each / k, 1e-4) << c;
    EXPECT_NEAR(cap_fit(static_cast<float>(c)).across, across * each / (b * d.x), 1e-4) << c;
  }
}

// E at the own normal exactly, no direction longer than its light, and no better such fit nearby.
TEST(ShL1Fit, IsTheBestThatShowsE) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int bounded = 0;
  for (int k = 0; k < 60; ++k) {
    const Vec3 n = on_cap((k + 0.5) / 60, 0.3 * k, -1);
    const Light light = random_light(random, n);
    const std::array<float, 4> f = finished<ShL1Cap>(light, n);
    const double e = light.irradiance(n);
    EXPECT_NEAR(ShL1::irradiance(f.data(), n), e, 2e-6 * e);
    EXPECT_LE(length(Vec3(f[1], f[2], f[3])), f[0]);
    bounded += length(Vec3(f[1], f[2], f[3])) > 0.999f * f[0];
    const Cap cap(light, n);
    const double best = cap.error(f.data());
    for (int trial = 0; trial < 200; ++trial) {
      const double size = std::pow(10.0, -3 + 3.0 * trial / 200) * e;
      Vec3 b =
          Vec3(f[1], f[2], f[3]) + Vec3(normal(random), normal(random), normal(random)) * float(size / 10);
      const float l0 = static_cast<float>(e / M_PI) - 2 * dot(b, n);
      if (!(length(b) <= l0)) continue;
      const float other[4] = {l0, b.x, b.y, b.z};
      // The set of normals stands for the integral to about 1e-4 of E^2.
      EXPECT_GE(cap.error(other), best - 2e-4 * e * e) << k;
    }
  }
  EXPECT_GT(bounded, 5);  // both branches were met
  EXPECT_LT(bounded, 55);
}

// What fits are for: errors relative to E(m) within 60 degrees, over random light (docs/bases.md).
TEST(ShL1Fit, ShowsLightBetterThanTheProjection) {
  std::mt19937 random(1);
  double squares[4][3] = {}, counts[3] = {};
  for (int k = 0; k < 400; ++k) {
    const Vec3 n(0, 0, 1);
    const Light light = random_light(random, n);
    const std::array<float, 4> plain = moments<ShL1>(light, n), cap = finished<ShL1Cap>(light, n),
                               hazel = finished<ShL1Hazel>(light, n);
    for (int i = 0; i < 120; ++i) {
      const Vec3 m = on_cap((i + 0.5) / 120, 0.61803398875 * i, kMu0);
      const double degrees = std::acos(double{m.z}) * 180 / M_PI, e = light.irradiance(m);
      const int band = degrees < 15 ? 0 : degrees < 35 ? 1 : 2;
      const double shown[4] = {ShL1::irradiance(plain.data(), m),
                               sh_l1_irradiance_nonlinear(plain[0], Vec3(plain[1], plain[2], plain[3]), m),
                               ShL1::irradiance(cap.data(), m),
                               ShL1Hazel::info().irradiance(hazel.data(), n, m)};
      for (int form = 0; form < 4; ++form) squares[form][band] += std::pow(shown[form] / e - 1, 2);
      ++counts[band];
    }
  }
  const char* names[] = {"project, linear", "project, hazel", "cap, linear", "cap, hazel"};
  for (int form = 0; form < 4; ++form) {
    std::printf("| %s |", names[form]);
    for (int band = 0; band < 3; ++band)
      std::printf(" %.1f |", 100 * std::sqrt(squares[form][band] / counts[band]));
    std::printf("\n");
  }
  for (int band = 0; band < 3; ++band) {
    EXPECT_LT(squares[2][band], squares[0][band]) << "cap against the projection, band " << band;
    EXPECT_LT(squares[3][band], 1.05 * squares[1][band] + (band == 2 ? squares[1][band] : 0)) << band;
  }
  EXPECT_LT(std::sqrt(squares[2][0] / squares[0][0]), 0.5);
}

TEST(ShL1Fit, HazelShowsE) {
  std::mt19937 random(3);
  for (int k = 0; k < 60; ++k) {
    const Vec3 n = on_cap((k + 0.5) / 60, 0.3 * k, -1);
    const Light light = random_light(random, n);
    const std::array<float, 4> f = finished<ShL1Hazel>(light, n);
    const double e = light.irradiance(n);
    EXPECT_NEAR(ShL1Hazel::info().irradiance(f.data(), n, n), e, 1e-5 * e);
    EXPECT_LE(length(Vec3(f[1], f[2], f[3])), f[0]);
  }
}

// No light, light that the normal does not see, values that cannot be.
TEST(ShL1Fit, Extremes) {
  const Vec3 n(0, 0, 1);
  for (const BasisInfo& basis : {ShL1Cap::info(), ShL1Hazel::info()}) {
    float dark[4] = {0.5f, 0.1f, 0.2f, -0.3f};
    basis.finish(0.0f, n, dark);
    EXPECT_EQ(dark[0], 0.0f);
    EXPECT_EQ(dark[3], 0.0f);
    // Denoised E and moments need not belong together.
    for (const float e : {1e-30f, 1e-6f, 1.0f, 1e6f, 1e30f})
      for (const float along : {-1e6f, -1.0f, 0.0f, 1.0f, 1e6f})
        for (const float across : {0.0f, 1.0f, 1e6f}) {
          float f[4] = {std::max(1.0f, 1e-3f * across), across, 0, along};
          basis.finish(e, n, f);
          EXPECT_NEAR(basis.irradiance(f, n, n) / e, 1, basis.evaluator == "linear" ? 4e-6 : 2e-5)
              << e << " " << along << " " << across;
          EXPECT_LE(length(Vec3(f[1], f[2], f[3])), f[0]) << e << " " << along << " " << across;
        }
  }
}

}  // namespace
}  // namespace kiln
