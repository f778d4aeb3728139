// Cuts a surface into pieces worth flattening.
#pragma once

#include <cstdint>
#include <vector>

#include "common/unwrap/flatten.h"

namespace kiln {

struct GrowSettings {
  double cone_degrees = 60;    // largest angle between a chart's normals and their mean
  uint32_t max_faces = 12000;  // of a chart that is grown or merged: bounds one solve
};

using FaceSets = std::vector<std::vector<uint32_t>>;

// Grows charts one after another, adding faces in order of cost: the angle to the chart's mean normal and the
// change of boundary length. (The idea of the costs: Sander, Wood, Gortler, Snyder, Hoppe 2003, "Multi-Chart
// Geometry Images", section 3.1.) Sides inside a chart become glued. Every face that is not degenerate is in
// exactly one chart; faces rise within one.
FaceSets grow_charts(const Surface& surface, ChartState& state, const GrowSettings& settings);

// Splits a glued chart between two far faces, by distance in faces; may return more than two parts.
FaceSets split_chart(const Surface& surface, ChartState& state, const std::vector<uint32_t>& faces);

}  // namespace kiln
