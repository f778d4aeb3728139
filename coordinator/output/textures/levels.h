// The map prepared for textures: stored planes, each texel's weight in lookups, and mip levels.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln {

// Weight of an encoder's error at texels that only lookups outside the chart's footprint read.
constexpr float kDilatedWeight = 1.0f / 64;

struct MapLevel {
  uint32_t page_height = 0, pages = 0;
  Planes planes;                // pages stacked; without "error" and "samples"
  std::vector<float> weight;    // 1 in a chart's footprint, kDilatedWeight where only dilated, 0: unused
  std::vector<uint32_t> owner;  // placement index + 1; 0: none

  size_t page_texels() const { return size_t{planes.width} * page_height; }
};

// Level 0 and `below` smaller ones (fewer where a side has one texel). Level k has max(1, side >> k) texels.
// A texel of a smaller level is the coverage-weighted mean of the texels of one chart below it, the chart
// with the largest coverage, so that light of two charts never mixes. One ring around charts is filled for
// bilinear lookups; packing decides which texels charts share (--mip-levels).
std::vector<MapLevel> map_levels(const Lightmap& map, const Atlas& atlas, uint32_t below);

}  // namespace kiln
