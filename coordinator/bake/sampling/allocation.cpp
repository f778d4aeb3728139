#include "coordinator/bake/sampling/allocation.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/format.h"
#include "common/base/parallel.h"
#include "common/job/unit.h"

namespace kiln {
namespace {

bool is_lit(const SampleState& s, size_t i) {
  return s.samples[i] > 0 && s.mean[i] > 0 && std::isfinite(s.standard_error[i]);
}

double relative_error(const SampleState& s, size_t i, double floor) {
  return s.standard_error[i] / std::max<double>(s.mean[i], floor);
}

// As it counts in kMeanSquare (ErrorNorm): with a bound.
double counted_error(const SampleState& s, size_t i, double floor) {
  return std::min(relative_error(s, i, floor), std::max(1.0, s.mean[i] / floor));
}

// Relative deviation of one sample, as if samples were independent.
double deviation(const SampleState& s, size_t i, double floor) {
  return relative_error(s, i, floor) * std::sqrt(s.samples[i]);
}
double counted_deviation(const SampleState& s, size_t i, double floor) {
  return counted_error(s, i, floor) * std::sqrt(s.samples[i]);
}

// A texel is as good as black up to kUnmetShare of the least mean that counts. Its own samples, before
// filters, have met light if they hold more than kMetShare of that; then they state an error of their own.
constexpr double kUnmetShare = 0.1, kMetShare = 1e-3;
bool samples_met_light(const SampleState& s, size_t i, double floor) {
  return s.measured.empty() ? s.mean[i] > kUnmetShare * floor : s.measured[i] > kMetShare * floor;
}
bool has_met_no_light(const SampleState& s, size_t i, double floor) {
  return s.samples[i] > 0 && s.mean[i] <= kUnmetShare * floor && std::isfinite(s.standard_error[i]) &&
         !samples_met_light(s, i, floor);
}

// The expected squared relative error of a site that has met no light in so many samples per replicate.
double unmet_square(double samples, double unmet) {
  return std::min(1.0, unmet / samples);
}

}  // namespace

double least_mean(const SampleState& s, ErrorNorm norm) {
  if (norm == ErrorNorm::kMax) return 0;
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < s.mean.size(); ++i) {
    if (!is_lit(s, i)) continue;
    sum += s.mean[i];
    ++count;
  }
  const double share = norm == ErrorNorm::kPerceptual ? kDarkest : kBlack;
  return count ? share * sum / static_cast<double>(count) : 0;
}

std::vector<float> planned_deviations(const SampleState& s, std::span<const uint32_t> chart_of_site) {
  const double floor = least_mean(s, ErrorNorm::kMeanSquare);
  std::vector<double> own(s.mean.size(), 0.0);
  for (size_t i = 0; i < own.size(); ++i)
    if (is_lit(s, i)) own[i] = counted_deviation(s, i, floor);
  std::vector<float> planned(own.size(), 0.0f);
  for_each_index(own.size(), 0, [&](size_t i) {
    if (!is_lit(s, i)) return;
    double sum = 0;
    size_t count = 0;
    const size_t last = std::min(own.size(), i + kPlannedReach + 1);
    for (size_t j = i > kPlannedReach ? i - kPlannedReach : 0; j < last; ++j) {
      if (j == i || chart_of_site[j] != chart_of_site[i] || !is_lit(s, j)) continue;
      sum += own[j];
      ++count;
    }
    const double around = count ? sum / static_cast<double>(count) : own[i];
    planned[i] = static_cast<float>(std::max(around, own[i] / kStandsOut));
  });
  return planned;
}

Expected<ErrorNorm> find_error_norm(std::string_view name) {
  if (name == "max") return ErrorNorm::kMax;
  if (name == "mean-square") return ErrorNorm::kMeanSquare;
  if (name == "perceptual") return ErrorNorm::kPerceptual;
  return fail(ErrorKind::kUsage,
              text("there is no error norm '{}': choose one of max, mean-square, perceptual", name));
}

std::vector<double> needed_samples(const SampleState& s, ErrorNorm norm, double error, double z, double fall,
                                   double unmet) {
  std::vector<double> needed(s.samples.begin(), s.samples.end());
  const double floor = least_mean(s, norm);
  const auto planned = [&](size_t i) {
    return s.planned.empty() ? counted_deviation(s, i, floor) : double{s.planned[i]};
  };
  double factor = z / error;  // needed = (factor x deviation)^2; kMeanSquare: factor x planned
  if (norm == ErrorNorm::kMeanSquare) {
    double sum = 0;  // of squared relative errors where counts equal planned deviations
    size_t count = 0;
    for (size_t i = 0; i < needed.size(); ++i) {
      if (!is_lit(s, i)) continue;
      const double own = counted_deviation(s, i, floor);
      if (own > 0) sum += own * own / planned(i);
      ++count;
    }
    size_t black = 0;
    for (size_t i = 0; unmet > 0 && i < needed.size(); ++i) black += has_met_no_light(s, i, floor);
    // needed = factor x planned, and n errors of planned^2 / needed each make up the target.
    factor = count ? factor * factor * (sum + static_cast<double>(black) * std::sqrt(unmet)) /
                         static_cast<double>(count)
                   : 0;
  }
  for (size_t i = 0; i < needed.size(); ++i)
    if (is_lit(s, i)) {
      const double wanted = factor * (norm == ErrorNorm::kMeanSquare ? planned(i) : deviation(s, i, floor));
      needed[i] = norm == ErrorNorm::kMeanSquare ? wanted : wanted * wanted;
      if (fall < 1 && needed[i] > s.samples[i])
        needed[i] = s.samples[i] * std::pow(needed[i] / s.samples[i], 1 / fall);
    }
  if (norm != ErrorNorm::kMeanSquare || !(unmet > 0)) return needed;
  const double wanted = factor * std::sqrt(unmet);  // `unmet` is the variance of one sample
  for (size_t i = 0; i < needed.size(); ++i)
    if (has_met_no_light(s, i, floor)) needed[i] = std::max(needed[i], wanted);
  return needed;
}

void UnmetLight::observe(const SampleState& before, const SampleState& after) {
  constexpr double kForget = 2;  // power of growth; makes what was found among many early texels fade in time
  const double floor_before = least_mean(before, ErrorNorm::kMeanSquare),
               floor = least_mean(after, ErrorNorm::kMeanSquare);
  double found = 0, inverses = 0, growth = 0;
  size_t black = 0;
  for (size_t i = 0; i < after.samples.size(); ++i) {
    if (!has_met_no_light(before, i, floor_before)) continue;
    ++black;
    if (after.samples[i] <= before.samples[i]) continue;
    inverses += 1.0 / before.samples[i] - 1.0 / after.samples[i];
    growth += std::log(static_cast<double>(after.samples[i]) / before.samples[i]);
    if (!samples_met_light(after, i, floor) || !is_lit(after, i)) continue;
    const double square = double{after.mean[i]} * after.mean[i];
    found += square / (square + floor * floor);
  }
  if (black == 0) return;
  const double kept = std::exp(-kForget * growth / static_cast<double>(black));
  found_ = kept * found_ + found;
  inverses_ = kept * inverses_ + inverses;
}

double UnmetLight::get() const {
  return found_ / inverses_;
}

std::vector<float> unmet_errors(const SampleState& s, double unmet) {
  const double floor = least_mean(s, ErrorNorm::kMeanSquare);
  std::vector<float> errors(s.samples.size(), 0.0f);
  for (size_t i = 0; i < errors.size(); ++i)
    if (has_met_no_light(s, i, floor))
      errors[i] = static_cast<float>(floor * std::sqrt(unmet_square(s.samples[i], unmet)));
  return errors;
}

void state_unmet_bands(const SampleState& s, std::span<float> band_errors) {
  const double floor = least_mean(s, ErrorNorm::kMeanSquare);
  double light = 0, band = 0;
  for (size_t i = 0; i < band_errors.size(); ++i) {
    if (!samples_met_light(s, i, floor) || !std::isfinite(s.standard_error[i])) continue;
    light += double{s.standard_error[i]} * s.standard_error[i];
    band += double{band_errors[i]} * band_errors[i];
  }
  const auto share = static_cast<float>(light > 0 ? std::sqrt(band / light) : 0);
  for (size_t i = 0; i < band_errors.size(); ++i)
    if (!samples_met_light(s, i, floor) && std::isfinite(s.standard_error[i]))
      band_errors[i] = share * s.standard_error[i];
}

void ConvergenceRate::observe(const SampleState& before, const SampleState& after) {
  for (size_t i = 0; i < after.samples.size(); ++i) {
    if (!is_lit(before, i) || !is_lit(after, i) || after.samples[i] <= before.samples[i]) continue;
    if (!(before.standard_error[i] > 0 && after.standard_error[i] > 0)) continue;
    errors_ += 2 * std::log(double{before.standard_error[i]} / after.standard_error[i]);
    samples_ += std::log(static_cast<double>(after.samples[i]) / before.samples[i]);
  }
}

double ConvergenceRate::get() const {
  // Prior worth a few texels, so that the first few do not decide.
  constexpr double kExpected = 0.9, kTexels = 100, kMin = 0.4;
  // Quantised, so that the last bits of logarithms decide nothing.
  constexpr double kSteps = 64;
  const double fall = (errors_ + kExpected * kTexels) / (samples_ + kTexels);
  return std::round(kSteps * std::clamp(fall, kMin, 1.0)) / kSteps;
}

double missing_samples(std::span<const double> needed, const SampleState& s, uint32_t most) {
  double sum = 0;
  for (size_t i = 0; i < needed.size(); ++i)
    sum += std::max(0.0, std::min<double>(needed[i], most) - s.samples[i]);
  return kReplicates * sum;
}

double affordable_error(const SampleState& s, ErrorNorm norm, double error, double z, uint32_t most,
                        double samples, double fall, double unmet) {
  // On large maps, a regular subset of texels estimates the total cost.
  constexpr size_t kAsked = 100'000;
  const size_t step_sites = std::max<size_t>(1, s.samples.size() / kAsked);
  std::vector<float> mean, deviation, planned, measured;
  std::vector<uint32_t> taken;
  for (size_t i = 0; i < s.samples.size(); i += step_sites) {
    mean.push_back(s.mean[i]);
    deviation.push_back(s.standard_error[i]);
    taken.push_back(s.samples[i]);
    if (!s.planned.empty()) planned.push_back(s.planned[i]);
    if (!s.measured.empty()) measured.push_back(s.measured[i]);
  }
  const SampleState some{mean, deviation, taken, planned, measured};
  const auto costs = [&](double e) {
    return static_cast<double>(step_sites) *
           missing_samples(needed_samples(some, norm, e, z, fall, unmet), some, most);
  };
  double low = std::max(error, 1e-6), high = std::max(low, reached_error(s, norm, z, unmet));
  if (costs(low) <= samples) return low;
  for (int step = 0; step < 40; ++step) {
    const double middle = std::sqrt(low * high);
    (costs(middle) > samples ? low : high) = middle;
  }
  return high;
}

double reached_error(const SampleState& s, ErrorNorm norm, double z, double unmet) {
  const double floor = least_mean(s, norm);
  double worst = 0, squares = 0;
  size_t count = 0;
  for (size_t i = 0; i < s.mean.size(); ++i) {
    if (has_met_no_light(s, i, floor)) squares += unmet_square(s.samples[i], unmet);
    if (!is_lit(s, i)) continue;
    worst = std::max(worst, relative_error(s, i, floor));
    if (norm == ErrorNorm::kMeanSquare) squares += counted_error(s, i, floor) * counted_error(s, i, floor);
    ++count;
  }
  if (count == 0) return 0;
  return z * (norm == ErrorNorm::kMeanSquare ? std::sqrt(squares / static_cast<double>(count)) : worst);
}

double error_share(const SampleState& s, std::span<const SiteSamples> work, double unmet) {
  const double floor = least_mean(s, ErrorNorm::kMeanSquare);
  const auto square = [&](size_t i) {
    const double relative = is_lit(s, i) ? counted_error(s, i, floor) : 0;
    return relative * relative + (has_met_no_light(s, i, floor) ? unmet_square(s.samples[i], unmet) : 0);
  };
  double all = 0, part = 0;
  for (size_t i = 0; i < s.mean.size(); ++i) all += square(i);
  for (const SiteSamples& w : work) part += square(w.site);
  return all > 0 ? part / all : 0;
}

bool is_vain(std::span<const SiteSamples> work, const SampleState& s, ErrorNorm norm, double asked, double z,
             double unmet) {
  constexpr double kShare = 0.01;
  if (norm != ErrorNorm::kMeanSquare || work.empty() || !(asked > 0)) return false;
  const double share = error_share(s, work, unmet);
  return share < kShare && reached_error(s, norm, z, unmet) * std::sqrt(1 - share) > asked;
}

}  // namespace kiln
