// Chart masks at their size in texels, and the placement that a packed mask gives its chart.
#pragma once

#include "common/atlas/chart_size.h"
#include "common/pack/pack.h"

namespace kiln {

// Distinct masks: the border lies on centres, so a chart's steps fix its scale and phase.
struct ChartMasks {
  struct Key {
    uint32_t charts, chart;
    Steps steps;
    auto operator<=>(const Key&) const = default;
  };
  std::vector<Key> keys;
  std::vector<uint32_t> of_placement;
  MaskSet texels;  // by key: bilinear footprints
  MaskSet cells;   // what is packed; empty if cells are texels

  const MaskSet& packed() const { return cells.size() ? cells : texels; }
};

ChartMasks chart_masks(const Atlas& atlas, const std::vector<MeshChartBoxes>& boxes,
                       const std::vector<ChartSize>& sizes, const std::vector<Steps>& steps,
                       const PackRules& rules, unsigned threads);

// By placement, as PackedChart::key.
std::vector<uint64_t> chart_keys(const ChartMasks& masks, const PackRules& rules);

// Fills atlas.placements, owner, packed_charts and the mask statistics.
void apply_packing(const PackResult& packed, const ChartMasks& masks,
                   const std::vector<MeshChartBoxes>& boxes, const PackRules& rules, Atlas& atlas);

}  // namespace kiln
