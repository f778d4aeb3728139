// The reported error of texels before filters: how far the mean of both replicates may be from the
// truth.
//
// It must hold for low-discrepancy samples (whose error is below sqrt(variance / n)), for
// irradiance caches (whose own error is shared by all texels of a replicate), for texels that
// missed a rare bright path that their neighbours found, and when it also decides when to stop
// (Kirk & Arvo 1991, Unbiased Sampling Techniques for Image Synthesis: stopping on a texel's own
// variance stops the texels that underestimate it).
//
// Hence  SE^2 = q S^2 / (2 n):  S^2, the variance of one sample, is the mean of the texel's own
// and its neighbourhood's; q, the ratio of the replicates' observed difference to that of
// independent samples, is pooled over a wider neighbourhood:  q = mean of (A - B)^2/4 / (S^2/(2
// n)).  (Replicates: Cranley & Patterson 1976; Owen 1997.)
#pragma once

#include <span>

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/texel_statistics.h"

namespace kiln {

struct TexelErrors {
  std::vector<float> mean, standard_error;  // by site: luminance of E; infinite if unknown
  std::vector<float> measured = {};         // by site: mean before filters; empty: the same
};

// Neighbourhoods are runs in the sites' Morton order, so near each other in the world: on the same
// chart for S, on any for q.
constexpr uint32_t kVarianceNeighbours = 24;  // on either side
constexpr uint32_t kReplicateNeighbours = 128;

// With errors drawn of the caches (cache_draws.h) q is that of single texels alone, without what (A - B) / 2
// has in common in texels alike (alike.h), and what texels share is added. S is then that of neighbours with
// about as much light: a dark room has bright texels in its doorway. (A texel's own samples say less: those
// that missed the rare bright ones have less light by a fifth, and a small variance.)
TexelErrors estimate_errors(const TexelStatistics& statistics, std::span<const uint32_t> chart_of_site);

// By site: variance of the mean of both replicates, but for what texels share.
std::vector<float> independent_variance(const TexelStatistics& statistics,
                                        std::span<const uint32_t> chart_of_site);

// The luminance of E of a texel with few samples is hardly known, but its sample count depends on
// it. By site, the mean over the texel and its neighbourhood (as for S); the texel's own mean has
// the weight of its samples against kMeanDoubt samples for the neighbours'.
constexpr double kMeanDoubt = 8;
std::vector<float> neighbourhood_means(const TexelStatistics& statistics,
                                       std::span<const uint32_t> chart_of_site);

// Effective sample count of a texel and its neighbourhood: (sum x)^2 / sum x^2 of the luminance of
// E (Kish 1965). Below kFewSamples the reported error rests on a few bright samples and may be too
// low.
constexpr double kFewSamples = 32;
std::vector<float> effective_samples(const TexelStatistics& statistics,
                                     std::span<const uint32_t> chart_of_site);

// Samples (of both replicates) of each site and its neighbourhood: the pool that S is computed over.
std::vector<float> samples_around(const TexelStatistics& statistics, std::span<const uint32_t> chart_of_site);

// Standard error of a band of the basis: of the length of its vector of luminances, one per
// function. Estimated from the replicates' differences at the site and around it, over as many
// samples as each has. `first_planes`: first plane of each function; its colours are consecutive. Where
// errors of the caches are drawn, what texels share is added as for E: the same fraction of the band's light
// as of E, because draws are of E alone.
std::vector<float> band_errors(const TexelStatistics& statistics, std::span<const uint32_t> chart_of_site,
                               std::span<const size_t> first_planes);

// Placement of each site's texel; coordinator only (Atlas::owner).
std::vector<uint32_t> charts_of_sites(const Atlas& atlas);

}  // namespace kiln
