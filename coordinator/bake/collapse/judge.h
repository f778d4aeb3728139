// Finds charts that are black or evenly lit, so that the minimum number of texels shows them as well as many,
// from a short first pass of full paths.
//
// Texels of a chart differ by noise and by light. Replicates A and B have independent noise and the same
// light e, so the mean of (A - c)(B - c) over some texels is an unbiased estimate of the mean of (e - c)^2,
// whatever the noise; its variance is (s^4 + 2 s^2 (e - c)^2) / texels, where s^2, the variance of the noise,
// is half the mean of (A - B)^2. (Two independent measurements for one square: the U-statistic of Hoeffding
// 1948, A Class of Statistics with Asymptotically Normal Distribution.)
//
// One value represents a chart if all of these hold, in every colour and every band, with a margin of kSure
// standard errors:
// - over the chart the root of that mean, taken as a standard error, leaves half of the square of the target
// error to noise;
// - over every block of kBlockTexels texels it is below the target error, so that a small shadow in a large
// chart is not averaged away;
// - no texel exceeds the target error by more than kFar times its noise.
// Each condition must be proved, not merely fail to be refuted: noise keeps texels. A chart that fails in one
// place is kept, so testing many blocks does not make errors more likely.
#pragma once

#include <span>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/responses/basis.h"
#include "coordinator/bake/lightmap/texel_statistics.h"

namespace kiln {

constexpr double kSure = 3;
constexpr double kFar = 4;
constexpr size_t kBlockTexels = 64;  // consecutive sites, so close to each other
constexpr size_t kMinEven = 16;      // known texels needed to estimate a chart's noise
// Samples over all texels of a chart. If none of n found light, at most three in n would, at 95 % confidence.
constexpr uint64_t kMinBlackSamples = 1000;

// Planes tested together: the functions of a band, each weighted by its effect on E at some normal.
struct EvenBand {
  std::vector<size_t> first_planes;  // index into TexelStatistics, by function; R, G, B are consecutive
  double scale = 1;                  // E per unit
};
// E at the surface normal, then the bands of the basis: a harmonic of degree l contributes at most
// (2 l + 1) in its direction, times pi in L0 and two thirds of it in L1 (ShL1: E(n) = pi L0 + 2 pi L1.n).
std::vector<EvenBand> even_bands(const BasisInfo& basis);

struct EvenRules {
  double error = 0.05;  // target, relative to the chart's mean
  double z = 1.96;      // half-width of the target interval in standard errors
  std::vector<EvenBand> bands;
};

struct ChartLight {
  CollapseReason why = kNotCollapsed;  // kUnlit, kEvenlyLit or neither
  // For an evenly lit chart, by band: upper bound on the root mean square of (light - mean) over its texels,
  // in luminance and the band's unit. Empty otherwise.
  std::vector<float> deviation;
};

// By placement. `chart_of_site`: placement + 1 of each site's texel, as charts_of_sites has it. Charts with
// an unsampled texel are kept. Independent of the number of threads.
std::vector<ChartLight> judge_charts(const TexelStatistics& statistics,
                                     std::span<const uint32_t> chart_of_site, size_t charts,
                                     const EvenRules& rules);
// The same test for black charts only; 1: no sample of any texel found light.
std::vector<uint8_t> black_charts(const TexelStatistics& statistics, std::span<const uint32_t> chart_of_site,
                                  size_t charts);

}  // namespace kiln
