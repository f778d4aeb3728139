// In which order the texels of a bake whose time is limited get their first sample: whole before fine.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/job/irradiance_cache.h"

namespace kiln {

// Sites by look, ascending in each: one texel of 8 x 8 and at least one of every chart; one of 4 x 4; one of
// 2 x 2; the rest. A fixed pattern of places in the atlas, so that it depends on nothing but the atlas.
std::vector<std::vector<uint32_t>> sites_by_look(const Atlas& atlas);

// The stride of texels that have their sample once the first `looks` looks are done: 8, 4, 2, 1.
uint32_t look_stride(size_t looks);

// Gives sites that have no sample yet what the samples around them say, so that paths which meet them can end
// there: of the texels of that stride within two strides and of the same chart (`chart` by site) by a tent of
// distance, else of the whole chart. `sampled` by site; where the chart has no known one sites stay unknown.
void fill_between(const Atlas& atlas, std::span<const uint32_t> chart, std::span<const uint8_t> sampled,
                  uint32_t stride, IrradianceCache& cache);

}  // namespace kiln
