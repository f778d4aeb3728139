// Measurements of every texel site in two replicates: independent halves of the samples, each with its own
// random numbers (and irradiance cache). Written by merge; read by the error estimate and the denoiser.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/zeroed.h"
#include "common/job/unit.h"

namespace kiln {

struct TexelStatistics {
  size_t sites = 0, planes = 0;               // planes: E.R E.G E.B, then the basis' (function major, R G B),
                                              // then direct light's if it is apart
  ZeroedVector<float> mean[kReplicates];      // [site][plane] of each replicate
  std::vector<float> luminance[kReplicates];  // [site] mean luminance of E of each replicate
  std::vector<float>
      variance;  // [site] variance of one sample's luminance of E, as if samples were independent
  // [site][kCacheDraws] errors drawn of the luminance of each replicate, by way of caches; empty without
  // draws
  ZeroedVector<float> drawn[kReplicates];
  std::vector<float>
      shared{};  // [site] relative variance by way of caches (sampling/cache_draws.h); may be empty
  std::vector<uint32_t> samples;  // [site] samples of each replicate; equal in both
  std::vector<uint8_t> known;     // [site] 0: inside geometry or without samples, so the values mean nothing
};

// Mean luminance of E of both replicates.
inline double mean_luminance(const TexelStatistics& s, size_t site) {
  return 0.5 * (double{s.luminance[0][site]} + double{s.luminance[1][site]});
}

// By site.
inline std::vector<float> mean_luminances(const TexelStatistics& s) {
  std::vector<float> means(s.sites);
  for (size_t site = 0; site < s.sites; ++site) means[site] = static_cast<float>(mean_luminance(s, site));
  return means;
}

// The variance of the mean of both replicates that their texels share: from the draws, `drawn`, and from the
// replicates' difference, `found`, whose expectation is the same. Each counts by its degrees of freedom.
inline double shared_variance(double drawn, double found) {
  constexpr double kDraws = kReplicates * kCacheDraws;
  return (kDraws * drawn + found) / (kDraws + 1);
}

}  // namespace kiln
