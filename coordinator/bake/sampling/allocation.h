// Where samples go: so many to each texel that the asked-for norm of the error is reached with the fewest.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace kiln {

// What of the map shall be within the asked-for error.
enum class ErrorNorm {
  kMax,         // every texel's interval, relative to its own mean
  kMeanSquare,  // z times the root of the mean over texels of (standard error / mean)^2, where means below
                // kBlack of the map's count as that: else one texel that is as good as black asks for all
  kPerceptual,  // every texel's interval, relative to its mean or kDarkest of the map's, whichever is more
};
constexpr double kDarkest = 0.1;
constexpr double kBlack = 0.01;  // as in the relMSE of coordinator/measure/compare
Expected<ErrorNorm> find_error_norm(std::string_view name);  // of --error-norm

struct SampleState {
  std::span<const float> mean, standard_error;  // by site; an infinite error: not known
  std::span<const uint32_t> samples;            // by site: in each replicate
};

// Means below this count as it in that norm; 0 in kMax.
double least_mean(const SampleState& state, ErrorNorm norm);

// Samples (in each replicate) that every site needs for z x error <= `error` in that norm, as far as the
// present standard errors tell: their squares fall as n^-fall. Sites without an error or light need what they
// have. kMeanSquare: Neyman 1934, n_i proportional to the relative deviation of one sample.
std::vector<double> needed_samples(const SampleState& state, ErrorNorm norm, double error, double z,
                                   double fall = 1);

// How errors fall with samples: 1 for means; less for a denoiser's, whose filters narrow as samples come
// (2/3 for planes fitted to a smooth field on a surface, at the best width). Learnt from what passes did.
class ConvergenceRate {
 public:
  // Of the sites that got more samples from one state to the other.
  void observe(const SampleState& before, const SampleState& after);
  double get() const;

 private:
  double errors_ = 0, samples_ = 0;  // logarithms of the ratios of squared errors and of counts, summed
};

// Samples of all sites and replicates that are missing to `needed`, where no site gets more than `most`.
double missing_samples(std::span<const double> needed, const SampleState& state, uint32_t most);

// The least error, not below `error`, that is reached with so many more samples (of all sites and
// replicates).
double affordable_error(const SampleState& state, ErrorNorm norm, double error, double z, uint32_t most,
                        double samples, double fall = 1);

// The norm itself, z included: what is reached now, to be compared with the asked-for error.
double reached_error(const SampleState& state, ErrorNorm norm, double z);

}  // namespace kiln
