#include "coordinator/run/statement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/format.h"

namespace kiln {
namespace {

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

PassPoint state_pass(const SampleState& state, std::span<const TexelErrors> responses, const Asked& asked,
                     double unmet) {
  PassPoint point;
  double samples = 0;
  uint64_t met = 0, measured = 0, converged = 0;
  const double black = least_mean(state, ErrorNorm::kMeanSquare);
  for (size_t site = 0; site < state.samples.size(); ++site) {
    if (state.samples[site] == 0 || !std::isfinite(state.standard_error[site])) continue;
    const double mean = state.mean[site], error = state.standard_error[site];
    ++measured;
    samples += kReplicates * state.samples[site];
    if (!(mean > 0)) continue;
    ++met;
    bool is_converged = asked.z * error <= asked.target * mean;
    for (const TexelErrors& e : responses) is_converged &= asked.z * e.standard_error[site] <= asked.response;
    converged += is_converged;
    point.worst_relative = std::max(point.worst_relative, error / std::max(mean, black));
  }
  point.rms_relative = reached_error(state, ErrorNorm::kMeanSquare, 1, unmet);
  // A texel whose samples are all black has unknown error; do not count it as converged.
  point.converged_share = measured > 0 && met == 0 ? 1 : 0;
  if (met > 0) point.converged_share = static_cast<double>(converged) / static_cast<double>(met);
  point.samples = measured ? samples / static_cast<double>(measured) : 0;
  return point;
}

MapStatement state_map(const TexelErrors& errors, const TexelStatistics& s, double target, double z) {
  MapStatement out;
  const double black = least_mean({errors.mean, errors.standard_error, s.samples}, ErrorNorm::kMeanSquare);
  std::vector<double> relative;
  relative.reserve(s.sites);
  uint64_t within = 0;
  for (size_t i = 0; i < s.sites; ++i) {
    if (s.samples[i] == 0) {
      ++out.never_sampled;
    } else if (!s.known[i]) {
      continue;  // inside geometry
    }
    ++out.texels;
    const double mean = errors.mean[i], error = errors.standard_error[i];
    if (s.samples[i] > 0 && !(mean > 0)) {
      ++out.met_no_light;
      continue;
    }
    const bool is_known = std::isfinite(error) && (s.samples[i] > 0 || error > 0);
    relative.push_back(is_known ? error / std::max(mean, black) : std::numeric_limits<double>::infinity());
    within += s.samples[i] > 0 && z * error <= target * mean;
  }
  out.median_relative = quantile(relative, 0.5);
  out.p95_relative = quantile(relative, 0.95);
  const uint64_t judged = out.texels - out.met_no_light;
  // A map without any light is reported as it is.
  out.within_target = judged ? static_cast<double>(within) / static_cast<double>(judged) : 1;
  return out;
}

ResponseStatement state_response(const ResponseInfo& response, const TexelErrors& errors,
                                 const Accumulator& sums, double target, double z) {
  std::vector<double> all;
  uint64_t within = 0;
  for (uint32_t site = 0; site < sums.sites(); ++site) {
    const double error = errors.standard_error[site];
    if (!std::isfinite(error) && sums.samples(site) > 0) continue;  // inside geometry
    all.push_back(error);
    within += z * error <= target;
  }
  ResponseStatement out{std::string(response.name)};
  out.within_target = all.empty() ? 0 : static_cast<double>(within) / static_cast<double>(all.size());
  out.median_error = quantile(all, 0.5);
  out.p95_error = quantile(all, 0.95);
  return out;
}

void warn_of_few_samples(const TexelStatistics& s, std::span<const uint32_t> charts, BakeReport& report) {
  for (const float n : effective_samples(s, charts)) report.statement.few_samples += n > 0 && n < kFewSamples;
  const uint64_t few = report.statement.few_samples;
  report.post.push_back({"texels of few bright samples", static_cast<double>(few), "texels"});
  report.post.push_back(
      {"texels that met no light", static_cast<double>(report.statement.met_no_light), "texels"});
  if (few > 0)
    report.warnings.push_back(
        text("{} texels are lit by fewer than {:.0f} bright samples, those of their neighbours included, and "
             "may be further off than error.exr says: give the bake more time or raise --min-samples",
             few, kFewSamples));
}

void check_dark(const Lightmap& map, const Atlas& atlas, BakeReport& report) {
  constexpr double kNoticed = 0.01;
  if (atlas.collapsed.empty()) return;
  std::vector<double> brightest(atlas.placements.size(), 0);
  double sum = 0;
  for (const uint32_t texel : atlas.sites.texel) {
    const double e =
        luminance(DVec3(map.planes.data[0][texel], map.planes.data[1][texel], map.planes.data[2][texel]));
    if (!std::isfinite(e)) continue;
    sum += e;
    // Texels pushed out of a wall may end up in the light.
    if (map.validity[texel] != Validity::kMeasured) continue;
    if (const uint32_t owner = atlas.owner[texel]) brightest[owner - 1] = std::max(brightest[owner - 1], e);
  }
  const double noticed = kNoticed * sum / static_cast<double>(std::max<size_t>(1, atlas.sites.size()));
  const auto check = [&](CollapseReason why, const char* taken, const char* remedy) {
    uint64_t lit = 0, bright = 0;
    size_t first = 0;
    double most = 0;
    for (size_t p = 0; p < brightest.size(); ++p) {
      if (atlas.collapsed[p] != why) continue;
      lit += brightest[p] > 0;
      bright += brightest[p] > noticed;
      if (brightest[p] > most) most = brightest[first = p];
    }
    if (bright == 0) return lit;
    const auto above =
        std::upper_bound(atlas.instance_first_chart.begin(), atlas.instance_first_chart.end(), first);
    const ObjectPlan& object =
        report.plan.objects[static_cast<size_t>(above - atlas.instance_first_chart.begin()) - 1];
    report.warnings.push_back(
        text("{} of the {} charts that {} met more light than {:g} % of the mean, most of it on '{}'; {}",
             bright, atlas.statistics.collapsed[why].charts, taken, 100 * kNoticed, object.name, remedy));
    return lit;
  };
  report.unseen_lit = check(kUnseen, "--unseen auto took for unseen",
                            "if they can be seen, --unseen keep gives them their texels");
  report.two_pass.black_lit =
      check(kUnlit, "the first pass of --two-pass found black", "--two-pass off gives them their texels");
}

}  // namespace kiln
