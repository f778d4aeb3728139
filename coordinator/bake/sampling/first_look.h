// The order in which texels of a time-limited bake get their first sample: coarse to fine over the whole map.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/job/irradiance_cache.h"
#include "coordinator/bake/sampling/schedule.h"

namespace kiln {

// Sites by look, ascending in each: one texel of 8 x 8 and at least one of every chart; one of 4 x 4; one of
// 2 x 2; the rest. The pattern is fixed in atlas coordinates, so it depends on the atlas alone.
std::vector<std::vector<uint32_t>> sites_by_look(const Atlas& atlas);

// Stride of the texels that have a sample after `looks` looks: 8, 4, 2, 1.
uint32_t look_stride(size_t looks);

// Keeps the sites of that stride, and one of every chart that has none of them.
void keep_stride(const Atlas& atlas, uint32_t stride, std::vector<SiteSamples>& work);

// Fills sites without a sample from sampled ones around them, so that paths can end there: from texels of
// that stride within two strides and on the same chart (`chart` by site), weighted by a tent of distance;
// failing that, from the whole chart. `sampled` by site; charts without a known site stay unknown.
void fill_between(const Atlas& atlas, std::span<const uint32_t> chart, std::span<const uint8_t> sampled,
                  uint32_t stride, IrradianceCache& cache);

}  // namespace kiln
