// How many texels each (instance, chart) gets.
#pragma once

#include "common/atlas/atlas.h"
#include "common/unwrap/charts.h"

namespace kiln {

struct ChartBox {
  DVec2 low{0.0}, extent{0.0};
  double area = 0;  // of its triangles, in chart space
};
struct MeshChartBoxes {
  ChartTriangles triangles;
  std::vector<ChartBox> boxes;  // by chart
};
// By set of charts.
std::vector<MeshChartBoxes> chart_boxes(const Atlas& atlas, unsigned threads);

// Extent of a placed chart in metres times its instance's density: at one texel per metre the chart is
// `metres` texels wide and high. `square_metres` likewise.
struct ChartSize {
  uint32_t instance, charts, chart;  // charts: index into Atlas::charts
  DVec2 metres;
  double square_metres;
};
// By placement. The scale keeps the area; the ratio of its axes follows how far the map stretches along
// them, so that an instance scaled along one axis gets square texels. `density`: by instance, or empty.
std::vector<ChartSize> chart_sizes(const Scene& scene, const Atlas& atlas,
                                   const std::vector<MeshChartBoxes>& boxes,
                                   const std::vector<float>& density, unsigned threads);

// Constraints that the settings put on masks. Packing works in cells; two charts never share one.
struct PackRules {
  uint32_t cell = 1;      // texels a side, a power of two
  uint32_t mip_cell = 1;  // texels of the smallest mip level a side
  uint32_t most = 0;      // texels along a chart's side

  // A chart's first centre lies this far and half a texel inside its first cell: just beyond the centre of a
  // mip cell, so that lookups do not reach the cell before.
  uint32_t margin() const { return mip_cell / 2; }
};
PackRules pack_rules(const AtlasSettings& settings);

// Texel steps between the first and the last centre, 1 or more on each axis: the extent rounded up.
struct Steps {
  uint32_t x, y;
  bool limited;  // the page was too small for it
  auto operator<=>(const Steps&) const = default;
};
Steps chart_steps(const ChartSize& size, double density, const PackRules& rules);

// Estimated texels in all masks.
double texels_needed(const std::vector<ChartSize>& sizes, double density, const PackRules& rules);
// A density, at most `density`, at which pages of `limit` texels in total suffice (0: none). Conservative:
// charts that are large for a page count with the space they waste on it.
double fitting_density(const std::vector<ChartSize>& sizes, double density, const PackRules& rules,
                       double limit);

}  // namespace kiln
