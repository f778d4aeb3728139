// What is said of a finished map as a whole: the figures that people read first.
#pragma once

#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/sampling/texel_errors.h"
#include "coordinator/report/report.h"

namespace kiln {

// `errors` by site, as published; z: half the width of the asked-for interval in standard errors.
MapStatement state_map(const TexelErrors& errors, const TexelStatistics& statistics, double target, double z);

// `errors` by site: absolute standard errors of a response. Texels that were never sampled are not within any
// target.
ResponseStatement state_response(const ResponseInfo& response, const TexelErrors& errors,
                                 const Accumulator& sums, double target, double z);

// Counts that errors do not tell, as figures and warnings: texels lit by a few bright samples, texels that
// met no light.
void warn_of_few_samples(const TexelStatistics& statistics, std::span<const uint32_t> charts,
                         BakeReport& report);

// Filtering lowers what texels are wrong by themselves; what they took from the first irradiance cache stays.
// `first_cache_error`: by site, relative; empty: no cache.
void warn_of_rough_cache(const TexelErrors& errors, std::span<const float> first_cache_error,
                         BakeReport& report);

// Charts that --unseen auto took for unseen are black, or something is wrong; so are those that the first
// pass of --two-pass found black: `map` as measured. Counts those that met light, and warns where that is
// more than a hundredth of the map's mean.
void check_dark(const Lightmap& map, const Atlas& atlas, BakeReport& report);

}  // namespace kiln
