#include "coordinator/bake/merge/response_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/parallel.h"

namespace kiln {
namespace {

// `least`: by site, the smallest error to report.
TexelErrors errors_of(const Accumulator& sums, size_t response, std::span<const uint32_t> charts,
                      std::span<const float> least) {
  const ResponseInfo& r = response_roster()[sums.layout().quantities().responses[response]];
  std::vector<TexelErrors> components;
  for (size_t c = 0; c < r.components; ++c)
    components.push_back(estimate_errors(sums.statistics_of(response, c), charts));
  TexelErrors out;
  out.mean.assign(sums.sites(), 0.0f);
  out.standard_error.assign(sums.sites(), std::numeric_limits<float>::infinity());
  for_each_index(sums.sites(), 0, [&](size_t site) {
    float means[kMaxComponents], errors[kMaxComponents];
    for (size_t c = 0; c < r.components; ++c) {
      means[c] = components[c].mean[site];
      errors[c] = components[c].standard_error[site];
    }
    if (!std::isfinite(errors[0])) return;
    out.mean[site] = 1.0f;
    out.standard_error[site] = std::max(least[site], r.standard_error(means, errors));
  });
  return out;
}

}  // namespace

std::vector<TexelErrors> response_errors(const Accumulator& sums, std::span<const uint32_t> charts) {
  std::vector<TexelErrors> out;
  const size_t responses = sums.layout().quantities().responses.size();
  if (responses == 0) return out;
  std::vector<float> least = samples_around(sums.statistics_of(0, 0), charts);
  for (uint32_t site = 0; site < least.size(); ++site)
    if (const double n = sums.samples(site); n > 0)
      least[site] = static_cast<float>(1 / std::sqrt((least[site] + 1.0) * n));
  for (size_t k = 0; k < responses; ++k) out.push_back(errors_of(sums, k, charts, least));
  return out;
}

}  // namespace kiln
