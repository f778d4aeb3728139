#include "coordinator/bake/seams/steps.h"

namespace kiln {
namespace {

// E.R E.G E.B come first in a map.
template <class OfPlane>
double luminance_of(const Lightmap& map, const OfPlane& of) {
  const auto& d = map.planes.data;
  return luminance(DVec3(of(d[0]), of(d[1]), of(d[2])));
}

}  // namespace

double light_of(const Lightmap& map, size_t texel) {
  return luminance_of(map, [&](const std::vector<float>& p) { return double{p[texel]}; });
}

double mean_light(const Lightmap& map) {
  double sum = 0, count = 0;
  for (size_t t = 0; t < map.validity.size(); ++t) {
    if (!is_set(map.validity[t])) continue;
    const double light = light_of(map, t);
    if (!std::isfinite(light)) continue;
    sum += light;
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

SeamSteps measure_steps(const Lightmap& map, std::span<const SeamEquation> equations) {
  SeamSteps steps;
  if (equations.empty()) return steps;
  const double dark = kDarkStep * mean_light(map);
  std::vector<std::pair<double, double>> all;  // step, texels
  all.reserve(equations.size());
  double length = 0;
  for (const SeamEquation& e : equations) {
    const double mean = luminance_of(map, [&](const std::vector<float>& p) { return seam_mean(e, p); });
    const double step = luminance_of(map, [&](const std::vector<float>& p) { return seam_step(e, p); });
    const double scale = std::max(mean, dark), relative = scale > 0 ? std::abs(step) / scale : 0;
    all.emplace_back(relative, e.texels);
    steps.rms += double{e.texels} * relative * relative;
    length += double{e.texels};
  }
  steps.rms = std::sqrt(steps.rms / length);
  std::sort(all.begin(), all.end());
  steps.largest = all.back().first;
  double beyond = 0;
  for (size_t i = all.size(); i-- > 0 && beyond <= 0.01 * length; beyond += all[i].second)
    steps.p99 = all[i].first;
  return steps;
}

}  // namespace kiln
