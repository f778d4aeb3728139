// What the texels that end their paths at one irradiance cache share of its error, from errors that are drawn
// of every cached value and carried along the paths (a bootstrap: Efron 1979; drawn by signs, not by
// resampling: the wild bootstrap of Wu 1986).
//
// A cached value errs by what it inherited from the cache before, and by the noise of its own samples. The
// first is what paths brought back (TexelStatistics::drawn); the second is drawn: plus or minus its standard
// deviation, independent for every texel. Both are errors of means, so the draws of the next pass are made of
// these as its light is of the light. The two replicates differ by one draw of the same error, which says
// little about its size; here are kReplicates x kCacheDraws more.
#pragma once

#include <span>

#include "common/job/irradiance_cache.h"
#include "coordinator/bake/lightmap/texel_statistics.h"

namespace kiln {

// How well a replicate's cached values are known, by site.
struct CacheNoise {
  std::span<const float> variance;     // of the mean of both replicates with all their samples; 0: unknown
  std::span<const uint32_t> measured;  // samples of each replicate behind that
  std::span<const uint32_t> cached;    // samples behind the cached value
};

// Adds the noise of a cache's own samples to its draws. `seed`: another one for each cache.
void add_noise_draws(const CacheNoise& noise, uint32_t seed, IrradianceCache& cache);

// Fills TexelStatistics::shared: by site, the variance of the mean of both replicates that comes from caches,
// over the square of the light. Draws are averaged over texels alike (alike.h), so that they lose the noise
// of single texels. Without draws it stays empty; the draws are used up.
void find_shared(std::span<const uint32_t> chart_of_site, TexelStatistics& statistics);

}  // namespace kiln
