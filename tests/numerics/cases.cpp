#include "tests/numerics/cases.h"

namespace kiln::test {

const std::vector<Case>& all_cases() {
  static const std::vector<Case> all = [] {
    std::vector<Case> cases;
    add_scale_cases(cases);
    add_light_cases(cases);
    add_geometry_cases(cases);
    add_sum_cases(cases);
    return cases;
  }();
  return all;
}

MeanE mean_e(const Bake& bake, std::optional<uint32_t> instance) {
  double sum = 0, squares = 0, weights = 0;
  for (const BakedTexel& t : bake.texels) {
    if (instance && t.instance != *instance) continue;
    sum += t.coverage * t.luminance;
    squares += t.coverage * t.coverage * t.standard_error * t.standard_error;
    weights += t.coverage;
  }
  return {sum / weights, std::sqrt(squares) / weights};
}

Measured against(const MeanE& mean, double truth) {
  return {truth, mean.value, 4 * mean.error + 0x1p-18 * std::abs(truth)};
}

Measured ratio_to(const Bake& bake, uint32_t instance,
                  const std::function<double(const Vec3&, const Vec3&)>& f) {
  double truth = 0, weights = 0;
  for (const BakedTexel& t : bake.texels) {
    if (t.instance != instance) continue;
    truth += t.coverage * texel_average(bake, t.site, f);
    weights += t.coverage;
  }
  truth /= weights;
  const MeanE m = mean_e(bake, instance);
  return against({m.value / truth, m.error / truth}, 1);
}

double polygon_irradiance(const Vec3& p, const Vec3& n, const std::vector<Vec3>& polygon) {
  double sum = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const DVec3 a = glm::normalize(DVec3(polygon[i]) - DVec3(p));
    const DVec3 b = glm::normalize(DVec3(polygon[(i + 1) % polygon.size()]) - DVec3(p));
    const DVec3 axis = glm::cross(a, b);
    const double s = glm::length(axis);
    if (s > 0) sum += std::atan2(s, glm::dot(a, b)) * glm::dot(DVec3(n), axis / s);
  }
  return 0.5 * std::abs(sum);
}

}  // namespace kiln::test
