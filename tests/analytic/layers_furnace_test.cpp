// A closed room that shines, with walls of metallic-roughness materials: E = pi (1 + rho) after one
// reflection, where rho is the albedo averaged over the cosine-weighted hemisphere, and about pi / (1 - rho)
// after all.
#include <numeric>

#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

constexpr double kRoughness[] = {0.2, 0.4, 0.6, 0.8, 1.0};
const Vec3 kColors(0.2f, 0.5f, 0.8f);  // one base colour a channel

// Single scattering off a GGX layer, integrated over the azimuth between both directions: an independent
// transcription of Heitz 2014 in double, on equal steps of both cosines. a: times F0, b: times F90.
class Lobe {
 public:
  static constexpr int kSteps = 128, kTurns = 256;
  explicit Lobe(double roughness) : a_(kSteps * kSteps), b_(kSteps * kSteps) {
    const double alpha = roughness * roughness;
    const auto lambda = [&](double z) {
      return 0.5 * (std::sqrt(1 + alpha * alpha * (1 - z * z) / (z * z)) - 1);
    };
    for (int o = 0; o < kSteps; ++o)
      for (int i = 0; i <= o; ++i) {
        const double zo = cos_of(o), zi = cos_of(i), ro = std::sqrt(1 - zo * zo), ri = std::sqrt(1 - zi * zi);
        const double masking = 1 / (4 * zo * zi * (1 + lambda(zo) + lambda(zi)));
        double a = 0, b = 0;
        for (int k = 0; k < kTurns; ++k) {
          const double phi = M_PI * (k + 0.5) / kTurns;
          const DVec3 h = glm::normalize(DVec3(ro + ri * std::cos(phi), ri * std::sin(phi), zo + zi));
          const double t = 1 + (alpha * alpha - 1) * h.z * h.z, oh = ro * h.x + zo * h.z;
          const double d = alpha * alpha / (M_PI * t * t), rise = std::pow(1 - oh, 5);
          a += d * (1 - rise);
          b += d * rise;
        }
        a_[o * kSteps + i] = a_[i * kSteps + o] = a * masking * 2 * M_PI / kTurns;
        b_[o * kSteps + i] = b_[i * kSteps + o] = b * masking * 2 * M_PI / kTurns;
      }
  }
  static double cos_of(int step) { return (step + 0.5) / kSteps; }
  double f(int o, int i, double f0, double f90) const {
    return f0 * a_[o * kSteps + i] + f90 * b_[o * kSteps + i];
  }
  std::vector<double> albedo(double f0, double f90) const {
    std::vector<double> e(kSteps, 0.0);
    for (int o = 0; o < kSteps; ++o)
      for (int i = 0; i < kSteps; ++i) e[o] += f(o, i, f0, f90) * cos_of(i) / kSteps;
    return e;
  }

 private:
  std::vector<double> a_, b_;
};

double mean(const std::vector<double>& f) {
  double sum = 0, weights = 0;
  for (size_t i = 0; i < f.size(); ++i) {
    sum += f[i] * Lobe::cos_of(static_cast<int>(i));
    weights += Lobe::cos_of(static_cast<int>(i));
  }
  return sum / weights;
}

struct Truth {
  double albedo;  // rho, the mean
  double sphere;  // E / pi in a sphere, where a ray leaves at the angle it arrived at
};
// What a dielectric over a Lambert layer or metal reflects (docs/maths.md), in double from the lobe alone.
Truth truth_of(const Lobe& lobe, bool metal, double color) {
  constexpr int n = Lobe::kSteps;
  const std::vector<double> below = metal ? lobe.albedo(1, 1) : lobe.albedo(0.04, 1);
  const double e = mean(below), f = color + (1 - color) / 21;
  const double share = metal ? f * f * e / (1 - f * (1 - e)) : color, f0 = metal ? color : 0.04;
  std::vector<double> kernel(n * n), albedo(n, 0.0);
  for (int o = 0; o < n; ++o)
    for (int i = 0; i < n; ++i) {
      const double value = lobe.f(o, i, f0, 1) + 2 * share * (1 - below[o]) * (1 - below[i]) / (1 - e);
      kernel[o * n + i] = value * Lobe::cos_of(i) / n;
      albedo[o] += kernel[o * n + i];
    }
  std::vector<double> radiance(n, 1.0);
  for (int step = 0; step < 200; ++step) {
    std::vector<double> next(n);
    for (int o = 0; o < n; ++o)
      next[o] = 1 + std::inner_product(radiance.begin(), radiance.end(), kernel.begin() + o * n, 0.0);
    radiance = std::move(next);
  }
  return {mean(albedo), mean(radiance)};
}

// E by channel, averaged over the area of the walls, over pi.
Vec3 bake(bool metal, double roughness, uint32_t bounces, uint32_t samples) {
  test::SceneMaker m;
  const uint32_t wall = m.metallic_roughness(kColors, metal, static_cast<float>(roughness));
  m.scene().materials[wall].properties.push_back({"emission", {1, 1, 1}, "", {}});
  m.box({0, 0, 0}, {1, 1, 1}, true);
  TransportSettings s;
  s.max_bounces = bounces;
  const auto b = test::bake(m.take(), 8, samples, s);
  DVec3 sum(0.0);
  double area = 0;
  for (const auto& t : b.texels) {
    sum += DVec3(t.e) * t.coverage;
    area += t.coverage;
  }
  return Vec3(sum / (area * M_PI));
}

TEST(LayersFurnace, WallsReflectTheirMeanAlbedo) {
  // By reciprocity the mean of one reflection over all walls of any room is pi rho. 0.1 % covers the noise of
  // the samples (four standard errors) and the steps of the quadrature; the table errs by less
  // (ggx_albedo.h).
  for (const bool metal : {false, true})
    for (const double roughness : kRoughness) {
      const Lobe lobe(roughness);
      const Vec3 e = bake(metal, roughness, 1, 1024);
      for (int k = 0; k < 3; ++k) {
        const double truth = 1 + truth_of(lobe, metal, kColors[k]).albedo;
        EXPECT_NEAR(e[k], truth, 0.001 * truth)
            << (metal ? "metal " : "dielectric ") << roughness << " " << k;
      }
    }
}

TEST(LayersFurnace, AllReflectionsAreThoseOfTheMeanAlbedo) {
  // pi / (1 - rho) holds if angles at both ends of a ray have nothing to do with each other. In a sphere they
  // are equal; a cube lies between. Where the albedo does not depend on the angle both are the same.
  std::printf("material   roughness  colour  rho     E/pi    1/(1-rho)  sphere\n");
  for (const bool metal : {false, true})
    for (const double roughness : kRoughness) {
      const Lobe lobe(roughness);
      const Vec3 e = bake(metal, roughness, 1000, 1024);
      for (int k = 0; k < 3; ++k) {
        const Truth t = truth_of(lobe, metal, kColors[k]);
        const double low = 1 / (1 - t.albedo);
        std::printf("%-10s %9.1f  %6.1f  %.4f  %.4f  %9.4f  %.4f\n", metal ? "metal" : "dielectric",
                    roughness, static_cast<double>(kColors[k]), t.albedo, static_cast<double>(e[k]), low,
                    t.sphere);
        EXPECT_GE(e[k], low * 0.998);
        EXPECT_LE(e[k], t.sphere * 1.002);
      }
    }
}

// The base colour of 0.5 under glTF's own defaults acts as 0.5095 (design of the layers: quadrature at width
// 1).
TEST(LayersFurnace, DefaultMaterial) {
  EXPECT_NEAR(bake(false, 1, 1000, 2048).y, 2 * 1.0194, 0.002 * 2);
}

}  // namespace
}  // namespace kiln
