// The map as textures need it: stored planes, what every texel is worth to a lookup, and smaller levels.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln {

// What an encoder's error at a texel counts that only lookups beyond the chart's footprint reach.
constexpr float kDilatedWeight = 1.0f / 64;

struct MapLevel {
  uint32_t page_height = 0, pages = 0;
  Planes planes;                // pages stacked; without "error" and "samples"
  std::vector<float> weight;    // 1 in a chart's footprint, kDilatedWeight where only dilated, 0: nobody's
  std::vector<uint32_t> owner;  // placement index + 1; 0: none

  size_t page_texels() const { return size_t{planes.width} * page_height; }
};

// Level 0 and `below` smaller ones (fewer where a side has one texel). Level k has max(1, side >> k) texels.
// A texel of a smaller level is the mean of the texels of one chart below it, weighted by how much of each
// its chart covers: the chart with most of it, so that light of two charts never mixes. One ring around is
// filled for lookups between texels; what charts share is decided by the packing (--mip-levels).
std::vector<MapLevel> map_levels(const Lightmap& map, const Atlas& atlas, uint32_t below);

}  // namespace kiln
