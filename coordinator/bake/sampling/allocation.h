// Sample allocation: each texel's count, so that the norm of the error meets its target with fewest samples.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "coordinator/bake/sampling/schedule.h"
#include "coordinator/bake/sampling/texel_errors.h"

namespace kiln {

// Which norm of the error has to reach the target.
enum class ErrorNorm {
  kMax,         // every texel's interval, relative to its own mean
  kMeanSquare,  // z times the root of the mean over texels of (standard error / mean)^2, where means below
                // kBlack of the map's count as that: else one texel that is as good as black asks for all.
                // A texel counts with at most 1, or mean / (kBlack x the map's) where that is more: light is
                // not negative, so that no error relative to the true light is larger
  kPerceptual,  // every texel's interval, relative to the larger of its mean and kDarkest of the map's
};
constexpr double kDarkest = 0.1;
constexpr double kBlack = 0.01;  // as in the relMSE of coordinator/measure/compare
Expected<ErrorNorm> find_error_norm(std::string_view name);  // parses --error-norm

struct SampleState {
  std::span<const float> mean, standard_error;  // by site; infinite error: unknown
  std::span<const uint32_t> samples;            // by site, per replicate
  // By site: relative deviation of one sample by which counts are planned (planned_deviations). Empty: each
  // site's own.
  std::span<const float> planned = {};
  // By site: mean of the site's own samples, before filters, which light black sites too. Empty: as `mean`.
  std::span<const float> measured = {};
};

inline SampleState state_of(const TexelErrors& errors, std::span<const uint32_t> samples,
                            std::span<const float> planned = {}) {
  return {errors.mean, errors.standard_error, samples, planned, errors.measured};
}

// Smaller means count as this value in that norm; 0 for kMax.
double least_mean(const SampleState& state, ErrorNorm norm);

// By site: the mean relative deviation of one sample (standard error / mean x root of the count, least mean
// of kMeanSquare) of the sites around, of the same chart, without the site's own. Where a site's own samples
// decide how many more it gets, its mean comes out too low: one that met a rare bright sample gets many more,
// which dilute it, and one that missed it keeps what it has (Kirk & Arvo 1991). A site's own deviation counts
// only beyond kStandsOut times that: what is sharp in truth needs more than its surroundings.
constexpr size_t kPlannedReach = 8;  // sites in Morton order, on either side
constexpr double kStandsOut = 2;
std::vector<float> planned_deviations(const SampleState& state, std::span<const uint32_t> chart_of_site);

// Samples (per replicate) that every site needs for z x error <= `error` in that norm, extrapolated from the
// present standard errors with squared errors falling as n^-fall. Sites without an error or light keep their
// count. kMeanSquare: Neyman 1934, n_i proportional to the relative deviation of one sample: the planned one
// if there is one, and the root of `unmet` (UnmetLight) for sites that have met no light, whose own error
// says nothing.
std::vector<double> needed_samples(const SampleState& state, ErrorNorm norm, double error, double z,
                                   double fall = 1, double unmet = 0);

// A texel may have met no light because there is none, or because few of its samples would: all of them are
// black, so is their variance, and such texels would stay black for ever. How much light they turn out to
// have is learnt from those that got more samples. (The problem of unseen species: Good 1953.)
//
// get() is U, the relative variance of one sample expected of such a texel, with means below the least that
// counts taken as that: after n samples its expected squared relative error is U / n, as a lit texel's is
// deviation^2 / n. So samples from n to m are expected to find U (1 / n - 1 / m), and U is the ratio of what
// they did find to that. It follows from chances p that a sample meets light of an even density U near 0 (the
// integral of U exp(-n p)), and is about how what passes find falls in rooms. Evidence is discounted by the
// square of the growth in samples since, so that maps whose last black texels are black in truth learn so;
// the power is empirical.
class UnmetLight {
 public:
  // Uses the sites that gained samples between the two states.
  void observe(const SampleState& before, const SampleState& after);
  double get() const;

 private:
  // What is expected before any pass, with the weight of so many texels that gain many times so many samples.
  static constexpr double kExpected = 0.25, kTexels = 100, kSamples = 16;
  double inverses_ = kTexels / kSamples;  // sum of 1 / n - 1 / m, discounted
  double found_ = kExpected * inverses_;  // squared relative error removed, discounted
};

// By site, what the site may have missed, as an absolute standard error: what the norm kMeanSquare expects of
// sites that have met no light, whose own samples state next to nothing. 0 for the others. `unmet`:
// UnmetLight::get().
std::vector<float> unmet_errors(const SampleState& state, double unmet);

// Replaces a band's errors at sites whose own samples have met no light by a fixed multiple of E's error,
// which includes what they may have missed: the ratio of both errors over the other sites (of the roots of
// their sums of squares).
void state_unmet_bands(const SampleState& state, std::span<float> band_errors);

// Squared errors fall as samples^-rate: 1 for means; less behind a denoiser, whose filters narrow as samples
// come (2/3 for planes fitted to a smooth field on a surface, at the best width). Learnt from passes.
class ConvergenceRate {
 public:
  // Uses the sites that gained samples between the two states.
  void observe(const SampleState& before, const SampleState& after);
  double get() const;

 private:
  double errors_ = 0, samples_ = 0;  // sums of logarithms of the ratios of squared errors and of counts
};

// Samples missing to reach `needed`, summed over sites and replicates, with at most `most` per site.
double missing_samples(std::span<const double> needed, const SampleState& state, uint32_t most);

// The smallest error, at least `error`, that `samples` more samples (over all sites and replicates)
// reach.
double affordable_error(const SampleState& state, ErrorNorm norm, double error, double z, uint32_t most,
                        double samples, double fall = 1, double unmet = 0);

// The present value of the norm, z included, to compare with the target error.
double reached_error(const SampleState& state, ErrorNorm norm, double z, double unmet = 0);

// What part of the squared error in the norm kMeanSquare is the error of the sites of `work`; 0 without error
// or light.
double error_share(const SampleState& state, std::span<const SiteSamples> work, double unmet = 0);

// Whether, in the norm kMeanSquare, sites that get no more samples have nearly all of the error, and alone
// more than is asked for (they are at their bound): a pass of few texels takes as long as a look at the whole
// map.
bool is_vain(std::span<const SiteSamples> work, const SampleState& state, ErrorNorm norm, double asked,
             double z, double unmet = 0);

}  // namespace kiln
