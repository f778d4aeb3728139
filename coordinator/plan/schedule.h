// Which samples exist: fixed bounds, so that sums do not depend on how work was cut or who did it.
#pragma once

#include <cstdint>
#include <vector>

#include "common/job/unit.h"

namespace kiln {

// Passes double: [0, min), [min, 2 min), [2 min, 4 min) ... up to max. At each bound the converged texels
// leave. (Flux steps by a tenth of the budget; doubling keeps whole powers of two of the sequence and
// bounds the oversampling at 2 for any budget.)
struct SampleRange {
  uint32_t first = 0, count = 0;
};
std::vector<SampleRange> sample_passes(uint32_t min_samples, uint32_t max_samples);

// A pass is summed in ranges of at most this many samples, whoever does them.
constexpr uint32_t kRangeSamples = 1024;
std::vector<SampleRange> ranges_of(SampleRange pass);

// Cuts a pass over `sites` (ascending: Morton order) into units of about tile_texels x 256 samples; all
// ranges of a run of sites are cut alike. Ids continue from next_id.
std::vector<WorkUnit> cut_pass(const std::vector<uint32_t>& sites, SampleRange pass, uint32_t tile_texels,
                               uint64_t& next_id);

}  // namespace kiln
