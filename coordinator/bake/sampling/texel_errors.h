// The stated error of texels, before filters: how far the mean of both replicates may be from the truth.
//
// What is asked of it: true for low-discrepancy samples (whose error is below sqrt(variance / n)), with
// irradiance caches (whose own error all texels of a replicate share), for texels that have not met a rare
// bright path that their neighbours have, and when it also decides when to stop (Kirk & Arvo 1991, Unbiased
// Sampling Techniques for Image Synthesis: a texel's own variance stops the texels that underestimate it).
//
// Hence  SE^2 = q S^2 / (2 n):  S^2, the variance of one sample, is the mean of the texel's own and of its
// neighbourhood's; q, by how much the replicates differ more or less than independent samples would, is
// pooled over a wider one:  q = mean of (A - B)^2/4 / (S^2/(2 n)).  (Replicates: Cranley & Patterson 1976;
// Owen 1997.)
#pragma once

#include <span>

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/texel_statistics.h"

namespace kiln {

struct TexelErrors {
  std::vector<float> mean, standard_error;  // by site: luminance of E; infinite where nothing is known
};

// Neighbourhoods are runs of the sites' order (Morton: near each other in the world): of the same chart for
// S, of any for q.
constexpr uint32_t kVarianceNeighbours = 24;  // on either side
constexpr uint32_t kReplicateNeighbours = 128;

TexelErrors estimate_errors(const TexelStatistics& statistics, std::span<const uint32_t> chart_of_site);

// Luminance of E of a texel of few samples is next to unknown, and what it needs depends on it: by site, the
// mean over the texel and its neighbourhood (as for S), where the texel's own counts as its samples do beside
// kMeanDoubt of the neighbours'.
constexpr double kMeanDoubt = 8;
std::vector<float> neighbourhood_means(const TexelStatistics& statistics,
                                       std::span<const uint32_t> chart_of_site);

// How many equal samples would tell as much as those that a texel and its neighbourhood have: (sum x)^2 / sum
// x^2 of the luminance of E (Kish 1965). Below kFewSamples what is stated rests on a few bright samples, and
// may be wrong by more than it says.
constexpr double kFewSamples = 32;
std::vector<float> effective_samples(const TexelStatistics& statistics,
                                     std::span<const uint32_t> chart_of_site);

// Samples (of both replicates) of each site and its neighbourhood: what S above is pooled over.
std::vector<float> samples_around(const TexelStatistics& statistics, std::span<const uint32_t> chart_of_site);

// Relative error of the light of a texel's chart as a whole, by site, where the errors of its texels are
// independent: what an irradiance cache made of these samples is wrong by, all texels alike. Paths that end
// at it carry that on, however many they are; two replicates are two draws of it, which may agree by chance.
// Charts of fewer than kSharingTexels count as that many: their texels see others too.
constexpr double kSharingTexels = 256;
std::vector<float> chart_errors(const TexelStatistics& statistics, std::span<const uint32_t> chart_of_site);

// Standard error of a band of the basis: of the length of its vector of luminances, one for each function.
// From the replicates' differences at the site and around it, as many samples as each has. `first_planes`: of
// its functions, whose colours follow each other.
std::vector<float> band_errors(const TexelStatistics& statistics, std::span<const uint32_t> chart_of_site,
                               std::span<const size_t> first_planes);

// Placement of each site's texel; coordinator only (Atlas::owner).
std::vector<uint32_t> charts_of_sites(const Atlas& atlas);

}  // namespace kiln
