// Statements about a finished map as a whole: the first figures that people read.
#pragma once

#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/sampling/allocation.h"
#include "coordinator/bake/sampling/texel_errors.h"
#include "coordinator/report/report.h"

namespace kiln {

// `errors` by site, as published; z: half-width of the requested interval in standard errors.
MapStatement state_map(const TexelErrors& errors, const TexelStatistics& statistics, double target, double z);

// What is asked of every texel: intervals of z standard errors within `target` of its mean, and of each
// response within `response`.
struct Asked {
  double z = 0, target = 0, response = 0;
};
// The map after a pass, from its samples and errors. `responses`: absolute, by site; `unmet` as of
// needed_samples(). Time and rays are not filled in.
PassPoint state_pass(const SampleState& state, std::span<const TexelErrors> responses, const Asked& asked,
                     double unmet);

// `errors` by site: absolute standard errors of a response. Texels that were never sampled are not
// within any target.
ResponseStatement state_response(const ResponseInfo& response, const TexelErrors& errors,
                                 const Accumulator& sums, double target, double z);

// Figures and warnings that errors do not show: texels lit by a few bright samples, texels that met
// no light.
void warn_of_few_samples(const TexelStatistics& statistics, std::span<const uint32_t> charts,
                         BakeReport& report);

// Charts that --unseen auto collapsed, or that the first pass of --two-pass found black, must be
// black in `map` (as measured). Counts those that met light, and warns if it exceeds a hundredth of
// the map's mean.
void check_dark(const Lightmap& map, const Atlas& atlas, BakeReport& report);

}  // namespace kiln
