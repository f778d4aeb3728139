// How far a bake is from a reference, and whether its reported error says so.
//
// A reference may come as two independent halves b1 and b2. Then (a - b1)(a - b2) replaces (a -
// b)^2: its expectation is the squared error of `a` alone, because the halves' noise is
// independent. With r = (b1 + b2) / 2, (b1 - b2)^2 / 4 estimates the variance of r, the reference's
// own noise.
#pragma once

#include <optional>

#include "coordinator/measure/compare/error_map.h"

namespace kiln {

struct CompareSettings {
  double error = 0.05, confidence = 0.95;  // as --error and --confidence of the bake
  size_t worst = 5;                        // number of texels listed
};

struct WorstTexel {
  uint32_t x = 0, y = 0, page = 0;
  double a = 0, reference = 0, stated = 0;  // luminance; `stated` is 0 if not reported
  std::string object;                       // object of the texel's chart, if charts.json tells
};

// Whether a bake's reported errors hold. The reported error is a standard error s; at confidence C
// the texel promises |a - r| <= z(C) s.
struct Calibration {
  double stated_rms = 0;  // root mean square of s / a over texels above a hundredth of a's mean
  double coverage = 0;    // share of texels with |a - r| <= z s; C if the errors are right
  // Mean over all texels of s^2 / (r^2 + f^2), f = mean of r / 100: the relMSE that the bake states. A texel
  // counts with max(1, (a / f)^2) at most: light is not negative, so that it errs by no more. Texels whose
  // error is unknown are left out.
  double stated_rel_mse = 0;
  // Over the texels of stated_rms: root of mean (a - r)^2 / s^2 without the reference's noise; 1 if s is
  // right.
  double error_ratio = 0;
  uint64_t promised = 0;      // lit texels with z s <= error x a, which promise to be within `error`
  double promise_kept = 0;    // share of these with |a - r| <= error x r; 0 if there are none
  double largest_stated = 0;  // over all texels, relative to a's brightest; above 1 no map can be that wrong
  double reference_part = 0;  // mean variance of r over mean s^2; near 1 the other figures mean little
};

// Over texels that were measured in all maps. Relative measures divide by r^2 + (mean of r /
// 100)^2, so that dark texels do not divide by zero.
struct Comparison {
  uint64_t texels = 0;
  double mean_a = 0, mean_reference = 0;
  double bias = 0,
         bias_error = 0;  // of the means; its standard error from the reference's halves, 0: unknown
  double mse = 0;         // may be negative with two halves: an error too small to measure
  double rel_mse = 0;
  double rel_mse_error = 0;                 // standard error of rel_mse, from its scatter over texels
  std::optional<double> reference_rel_mse;  // of r itself: from the halves, otherwise from its own error.exr
  std::optional<double> ssim;               // of `a` against r, including r's noise (ssim.h)
  std::optional<double> reference_ssim;     // between the reference's halves: what noise alone leaves
  double within = 0;                        // share with |a - r| <= error x r
  double percentiles[5] = {};               // of |a - r| / sqrt(r^2 + (mean / 100)^2) at kComparePercentiles
  std::optional<Calibration> calibration;   // if `a` reports its error
  std::vector<WorstTexel> worst;
  double rmse() const;  // 0 if mse is negative
};
constexpr double kComparePercentiles[] = {50, 90, 95, 99, 100};

// b2: the second half of the reference, or null. All maps must have the same layout; errors say what to do.
Expected<Comparison> compare_maps(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2,
                                  const CompareSettings& settings);

// (a - r) / sqrt(r^2 + (mean of r / 100)^2) by texel; NaN where a map was not measured. Same
// requirements as compare_maps.
std::vector<double> relative_differences(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2);

}  // namespace kiln
