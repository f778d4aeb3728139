#include "tests/analytic/cie171/cases.h"

#include <array>

namespace kiln::test {
namespace {

constexpr int kNodes = 8;
struct Rule {
  std::array<double, kNodes> node, weight;
};

// Newton's iteration on the Legendre polynomial (Press et al. 2007, Numerical Recipes, 4.6).
Rule gauss_legendre() {
  Rule rule;
  for (int i = 0; i < kNodes; ++i) {
    double x = std::cos(M_PI * (i + 0.75) / (kNodes + 0.5)), slope = 0;
    for (int step = 0; step < 50; ++step) {
      double p = 1, before = 0;
      for (int k = 1; k <= kNodes; ++k) {
        const double next = ((2 * k - 1) * x * p - (k - 1) * before) / k;
        before = p;
        p = next;
      }
      slope = kNodes * (x * p - before) / (x * x - 1);
      x -= p / slope;
    }
    rule.node[i] = x;
    rule.weight[i] = 2 / ((1 - x * x) * slope * slope);
  }
  return rule;
}

using Integrand = std::function<double(double)>;

double apply(double low, double high, const Integrand& f) {
  static const Rule rule = gauss_legendre();
  double sum = 0;
  for (int i = 0; i < kNodes; ++i)
    sum += rule.weight[i] * f(0.5 * (low + high) + 0.5 * (high - low) * rule.node[i]);
  return 0.5 * (high - low) * sum;
}

double refine(double low, double high, double whole, double left, double right, const Integrand& f,
              int depth) {
  constexpr double kTolerance = 1e-6;
  constexpr int kDeepest = 20;
  const double sum = left + right;
  if (std::abs(sum - whole) <= kTolerance * std::abs(sum) || depth == kDeepest) return sum;
  const double middle = 0.5 * (low + high), l = 0.5 * (low + middle), r = 0.5 * (middle + high);
  return refine(low, middle, left, apply(low, l, f), apply(l, middle, f), f, depth + 1) +
         refine(middle, high, right, apply(middle, r, f), apply(r, high, f), f, depth + 1);
}

}  // namespace

const std::vector<CieCase>& all_cie_cases() {
  static const std::vector<CieCase> all = [] {
    std::vector<CieCase> cases;
    add_lamp_cases(cases);
    add_glass_cases(cases);
    add_reflection_cases(cases);
    add_roof_cases(cases);
    add_facade_cases(cases);
    return cases;
  }();
  return all;
}

void receive_only(Scene& scene, std::initializer_list<uint32_t> instances) {
  for (Instance& i : scene.instances) i.receive = false;
  for (const uint32_t i : instances) scene.instances[i].receive = true;
}

Outcome compare_with(const Bake& bake, uint32_t instance, const Irradiance& truth) {
  Outcome out;
  double weights = 0, squares = 0, texels = 0;
  for (const BakedTexel& t : bake.texels) {
    if (t.instance != instance) continue;
    const double exact = texel_average(bake, t.site, truth);
    out.expected += t.coverage * exact;
    out.measured += t.coverage * t.luminance;
    squares += t.coverage * t.coverage * t.standard_error * t.standard_error;
    out.within += std::abs(t.luminance - exact) <= 3 * t.standard_error;
    weights += t.coverage;
    ++texels;
  }
  return {out.expected / weights, out.measured / weights, std::sqrt(squares) / weights, out.within / texels};
}

double from_polygon(const Vec3& p, const Vec3& n, const std::vector<DVec3>& polygon) {
  double sum = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const DVec3 a = glm::normalize(polygon[i] - DVec3(p));
    const DVec3 b = glm::normalize(polygon[(i + 1) % polygon.size()] - DVec3(p));
    const DVec3 axis = glm::cross(a, b);
    const double s = glm::length(axis);
    if (s > 0) sum += std::atan2(s, glm::dot(a, b)) * glm::dot(DVec3(n), axis / s);
  }
  return 0.5 * std::abs(sum);
}

double integrate(double low, double high, const std::function<double(double)>& f) {
  const double middle = 0.5 * (low + high);
  return refine(low, high, apply(low, high, f), apply(low, middle, f), apply(middle, high, f), f, 0);
}

}  // namespace kiln::test
