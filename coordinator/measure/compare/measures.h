// How far a bake is from a reference, and whether it said so.
//
// A reference may come as two independent halves b1 and b2. Then (a - b1)(a - b2) takes the place of (a -
// b)^2: its expectation is the squared error of `a` alone, because the halves' own noises are independent of
// each other. With r = (b1 + b2) / 2, (b1 - b2)^2 / 4 estimates the variance of r: the noise of the reference
// itself.
#pragma once

#include <optional>

#include "coordinator/measure/compare/error_map.h"

namespace kiln {

struct CompareSettings {
  double error = 0.05, confidence = 0.95;  // as --error and --confidence of the bake
  size_t worst = 5;                        // texels listed
};

struct WorstTexel {
  uint32_t x = 0, y = 0, page = 0;
  double a = 0, reference = 0, stated = 0;  // luminance; `stated` 0 where nothing is stated
  std::string object;                       // whose chart it is of, where charts.json says so
};

// Whether a bake's statements of its error hold. A stated error is a standard error s; at the confidence C
// the texel promises |a - r| <= z(C) s.
struct Calibration {
  double stated_rms = 0;  // root of the mean of (s / a)^2 over texels above a hundredth of a's mean
  double coverage = 0;    // share of texels with |a - r| <= z s: C if the statements are true
  // Of the same texels: root of mean (a - r)^2 / s^2, the reference's noise taken out; 1 if they are true.
  double error_ratio = 0;
  uint64_t promised = 0;      // texels with light, z s <= error x a: they say that they are within `error`
  double promise_kept = 0;    // the share of these with |a - r| <= error x r; 0 if there are none
  double largest_stated = 0;  // of all, relative to the brightest texel of a: above 1 no map can be so wrong
  double reference_part = 0;  // mean variance of r over mean s^2: the other figures mean little near 1
};

// Over texels that were measured in all maps. Relative measures divide by r^2 + (mean of r / 100)^2: dark
// texels do not divide by nothing.
struct Comparison {
  uint64_t texels = 0;
  double mean_a = 0, mean_reference = 0;
  double bias = 0,
         bias_error = 0;  // of the means; the standard error that the reference's halves show, 0: unknown
  double mse = 0;         // may be below 0 with two halves: an error too small to be told from none
  double rel_mse = 0;
  double rel_mse_error = 0;                 // standard error of rel_mse, from its scatter over texels
  std::optional<double> reference_rel_mse;  // of r itself: from halves, else from its own error.exr
  std::optional<double> ssim;               // ssim.h: of `a` and r, whose noise is in it
  std::optional<double> reference_ssim;     // of the reference's halves: what its noise alone leaves
  double within = 0;                        // share with |a - r| <= error x r
  double percentiles[5] = {};               // of |a - r| / sqrt(r^2 + (mean / 100)^2) at kComparePercentiles
  std::optional<Calibration> calibration;   // if `a` states its error
  std::vector<WorstTexel> worst;
  double rmse() const;  // 0 where mse is below 0
};
constexpr double kComparePercentiles[] = {50, 90, 95, 99, 100};

// b2: the second half of the reference, or null. All maps have one layout; errors say what to do.
Expected<Comparison> compare_maps(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2,
                                  const CompareSettings& settings);

// (a - r) / sqrt(r^2 + (mean of r / 100)^2) by texel; NaN where a map was not measured. Maps as compare_maps
// takes them.
std::vector<double> relative_differences(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2);

}  // namespace kiln
