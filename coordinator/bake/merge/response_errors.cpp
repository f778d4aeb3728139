#include "coordinator/bake/merge/response_errors.h"

#include <limits>

#include "common/base/parallel.h"

namespace kiln {

TexelErrors response_errors(const Accumulator& sums, size_t response, std::span<const uint32_t> charts) {
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
    if (!(errors[0] < std::numeric_limits<float>::infinity())) return;
    out.mean[site] = 1.0f;
    out.standard_error[site] = r.standard_error(means, errors);
  });
  return out;
}

}  // namespace kiln
