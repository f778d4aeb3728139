// Cutting a surface into pieces that are worth trying to flatten.
#pragma once

#include <cstdint>
#include <vector>

#include "common/unwrap/flatten.h"

namespace kiln {

struct GrowSettings {
  double cone_degrees = 60;    // a chart's normals stay this near to their mean
  uint32_t max_faces = 12000;  // of a chart that is grown or merged: bounds one solve
};

using FaceSets = std::vector<std::vector<uint32_t>>;

// Charts grown one after another, each face taken in the order of its cost: its angle to the chart's mean
// normal and what it does to the length of the boundary. (The idea of the costs: Sander, Wood, Gortler,
// Snyder, Hoppe 2003, "Multi-Chart Geometry Images", section 3.1.) Sides inside a chart become glued. Every
// face that is not degenerate is in exactly one chart; faces rise within one.
FaceSets grow_charts(const Surface& surface, ChartState& state, const GrowSettings& settings);

// Cuts a glued chart in two between two far faces, by distance in faces; parts may be several.
FaceSets split_chart(const Surface& surface, ChartState& state, const std::vector<uint32_t>& faces);

}  // namespace kiln
