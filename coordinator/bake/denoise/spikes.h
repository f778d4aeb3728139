// Fireflies: a texel that only one replicate found very bright would become a blob as wide as its filter. Its
// light is right on average, but belongs to the whole surface. So the excess is removed from the texel and
// returned to its piece of surface, to all texels in proportion to their light; the uncertainty of that gain
// goes into the reported error. (DeCoro et al. 2010 and Zirr et al. 2018 drop or reweight outliers and lose
// light; here the sum over a piece is kept.)
#pragma once

#include <vector>

#include "coordinator/bake/lightmap/texel_statistics.h"
#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

struct Spikes {
  std::vector<float> keep[kReplicates];  // by site: share of the measured light that is kept
  std::vector<float> gain;               // by site: gain of its piece, at least 1
  std::vector<float> relative_error;     // by site: of the gain
};

// Sums use integers: the same for any number of threads and any order of sites.
Spikes find_spikes(const TexelStatistics& statistics, const std::vector<uint8_t>& known,
                   const std::vector<uint32_t>& pieces, const SurfaceLinks& links, unsigned threads);

}  // namespace kiln
