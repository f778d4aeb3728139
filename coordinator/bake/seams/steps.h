// The size of steps of light across seams, as a viewer would see them.
#pragma once

#include <span>

#include "coordinator/bake/seams/equations.h"

namespace kiln {

// Statistics of |side 0 - side 1| of the luminance of E over all equations, relative to the mean of both or
// to kDarkStep of the map's mean, whichever is larger: a step between two nearly black texels is invisible.
struct SeamSteps {
  double largest = 0, rms = 0;
  double p99 = 0;  // 99th percentile by length of seam, in texels
};
constexpr double kDarkStep = 0.01;  // as ErrorNorm::kMeanSquare and relMSE take it

SeamSteps measure_steps(const Lightmap& map, std::span<const SeamEquation> equations);

// Mean over texels that are set.
double mean_light(const Lightmap& map);

// E of one texel.
double light_of(const Lightmap& map, size_t texel);

}  // namespace kiln
