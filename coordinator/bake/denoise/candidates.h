// The luminance of E of every site through every filter, each replicate by itself.
#pragma once

#include "coordinator/bake/denoise/kernel.h"
#include "coordinator/bake/denoise/spikes.h"
#include "coordinator/bake/lightmap/texel_statistics.h"
#include "coordinator/bake/neighbours/pieces.h"

namespace kiln {

// Everything is in units of `scale`, a power of two near the largest luminance, so that squares stay in
// range.
struct Candidates {
  double scale = 1;
  std::vector<uint8_t> known;                              // by site: known, finite, with samples and a place
  std::vector<uint32_t> samples;                           // by site: of each replicate
  std::vector<uint32_t> piece;                             // by site (pieces.h)
  std::vector<float> keep[kReplicates], gain, gain_error;  // by site (spikes.h); values below are without
                                                           // spikes and before the gain
  std::vector<float> shared;                               // by site: TexelStatistics::shared; may be empty
  std::vector<float> prior;  // by site: variance of the mean of both replicates as if samples were
                             // independent, from the site and its linked sites
  std::vector<float> value[kReplicates][kLevels];  // by site; level 0: as measured
  std::vector<float> variance[kLevels];  // by site: variance of the mean of both replicates, assuming `prior`
};

Candidates find_candidates(const TexelStatistics& statistics, const SiteGeometry& sites,
                           const SurfaceLinks& links, unsigned threads, WindowTables tables = {});

}  // namespace kiln
