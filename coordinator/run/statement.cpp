#include "coordinator/run/statement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/format.h"
#include "coordinator/plan/allocation.h"

namespace kiln {
namespace {

// The passes after the first cache take a part of its error away. Chosen on the bench scenes: most texels of
// rooms lit by a slit are beyond this, few of the others.
constexpr double kRefined = 0.5;

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

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
  // A map without any light is what it is.
  out.within_target = judged ? static_cast<double>(within) / static_cast<double>(judged) : 1;
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

void warn_of_rough_cache(const TexelErrors& errors, std::span<const float> first_cache_error,
                         BakeReport& report) {
  if (first_cache_error.empty()) return;
  uint64_t doubtful = 0;
  for (size_t i = 0; i < errors.mean.size(); ++i)
    doubtful += std::isfinite(errors.standard_error[i]) &&
                errors.standard_error[i] < kRefined * first_cache_error[i] * errors.mean[i];
  report.post.push_back({"texels of a rough first cache", static_cast<double>(doubtful), "texels"});
  if (doubtful > 0)
    report.warnings.push_back(
        text("{} texels are lit by way of surfaces that the first samples hardly found, and may all be off "
             "together by more than error.exr says: check with --denoise off or --cache off",
             doubtful));
}

}  // namespace kiln
