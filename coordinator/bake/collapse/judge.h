// Which charts are black, or lit the same all over, so that the least texels show them as well as many: asked
// of a short first pass of whole paths.
//
// What a chart's texels differ by is noise and light. Replicates A and B have noise of their own and the same
// light e, so that the mean of (A - c)(B - c) over some texels estimates that of (e - c)^2 without bias,
// whatever the noise; its own variance is (s^4 + 2 s^2 (e - c)^2) / texels, where s^2, that of the noise, is
// half the mean of (A - B)^2. (Two independent measurements for one square: the U-statistic of Hoeffding
// 1948, A Class of Statistics with Asymptotically Normal Distribution.)
//
// One value shows a chart if all of this is so, in every colour and every band, with kSure standard errors to
// spare:
// - over the chart the root of that mean is so small that, taken for a standard error, it leaves half of the
//   square of the asked-for error to noise;
// - over every block of kBlockTexels texels it is below the asked-for error, so that the little shadow in a
//   large chart is not averaged away;
// - no texel is beyond the asked-for error by more than kFar times its noise.
// Each of these must be shown, not refuted: noise keeps texels. A chart that fails in one place is kept
// whatever the others say, so that many blocks make no mistake more likely.
#pragma once

#include <span>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/responses/basis.h"
#include "coordinator/bake/lightmap/texel_statistics.h"

namespace kiln {

constexpr double kSure = 3;
constexpr double kFar = 4;
constexpr size_t kBlockTexels = 64;  // in the sites' order: near each other
constexpr size_t kMinEven = 16;      // known texels from which on a chart's noise is known well enough
// Of all texels of a chart. Where none of so many has met light, three in so many would at most, at 95 %.
constexpr uint64_t kMinBlackSamples = 1000;

// Planes that are constant together: the functions of a band, each as it counts in E at some normal.
struct EvenBand {
  std::vector<size_t> first_planes;  // of TexelStatistics, by function; R, G, B follow each other
  double scale = 1;                  // E for a unit of it
};
// E at the surface normal, then the bands of the basis: a degree l of harmonics counts for at most
// (2 l + 1) in its direction, times pi in L0 and two thirds of it in L1 (ShL1: E(n) = pi L0 + 2 pi L1.n).
std::vector<EvenBand> even_bands(const BasisInfo& basis);

struct EvenRules {
  double error = 0.05;  // asked for, relative to the chart's mean
  double z = 1.96;      // half the width of the asked-for interval in standard errors
  std::vector<EvenBand> bands;
};

struct ChartLight {
  CollapseReason why = kNotCollapsed;  // kUnlit, kEvenlyLit or neither
  // Of an evenly lit chart: by band, what the root mean square over its texels of (light - mean) is at most,
  // in luminance and in the band's own unit. Empty otherwise.
  std::vector<float> deviation;
};

// By placement. `chart_of_site`: placement + 1 of each site's texel, as charts_of_sites has it. Charts with a
// texel that was not sampled stay as they are. The same for any number of threads.
std::vector<ChartLight> judge_charts(const TexelStatistics& statistics,
                                     std::span<const uint32_t> chart_of_site, size_t charts,
                                     const EvenRules& rules);
// The same by blackness alone: 1, no sample of any texel met light.
std::vector<uint8_t> black_charts(const TexelStatistics& statistics, std::span<const uint32_t> chart_of_site,
                                  size_t charts);

}  // namespace kiln
