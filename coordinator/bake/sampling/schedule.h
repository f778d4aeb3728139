// Which samples exist: fixed bounds, so that sums do not depend on how work is cut or who does it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/job/unit.h"
#include "coordinator/bake/sampling/texel_errors.h"

namespace kiln {

struct SampleRange {
  uint32_t first = 0, count = 0;
};

// The smallest allowed sample count (per texel and replicate) not below `needed`. There are four
// counts per power of two (16, 20, 24, 28, 32, 40 ...), so the overshoot is a tenth on average and
// texels of a pass share few ranges. (Flux steps by a tenth of the budget.)
uint32_t sample_count(double needed);

// Samples per replicate of the first pass, whose whole paths make the first caches and are then dropped: 16;
// 8 from 65,536 sites and 4 from 131,072, which takes fewer rays to the same error (docs/performance.md).
// Bakes with a time limit begin otherwise (first_look.h).
uint32_t pilot_samples(size_t sites);
// Stride of the texels that have them (first_look.h): 2 from 1,048,576 sites.
uint32_t pilot_stride(size_t sites);

// A pass is summed in ranges of at most this many samples, on whichever machine.
constexpr uint32_t kRangeSamples = 1024;
std::vector<SampleRange> ranges_of(SampleRange pass);

// Samples that a site gets in a pass, per replicate.
struct SiteSamples {
  uint32_t site;
  SampleRange range;
  uint32_t take = 0;  // WorkUnit::take
};
// The next samples of sites that have some: up to what is needed or may be had, but no more than kGrowth
// times what they have, and no less than `least` times. By site: `needed`, `have`; per replicate.
constexpr double kGrowth = 4;
std::vector<SiteSamples> work_towards(std::span<const double> needed, std::span<const uint32_t> have,
                                      uint32_t most, double least);
// Over sites and replicates.
double samples_of(std::span<const SiteSamples> work);

// Cuts a pass over sites (ascending: Morton order) into units of about tile_texels x 256 samples of
// one replicate, one take and one range; all ranges of a run of sites are cut alike. `caches`: the cache that
// units of each replicate name. Ids continue from next_id.
std::vector<WorkUnit> cut_pass(const std::vector<SiteSamples>& work, uint32_t tile_texels,
                               std::span<const Digest> caches, uint64_t& next_id);

// Sorts units by descending error of their sites, so that a bake stopped by time has spent it where the error
// was. Runs of texels stay whole, so neighbours stay together. The order changes no byte of the result.
// `errors`: of every site, or empty, which leaves the order as it is.
void order_by_gain(const TexelErrors& errors, std::vector<WorkUnit>& units);

}  // namespace kiln
