// How alike two maps look.
#pragma once

#include "coordinator/measure/compare/chart_boxes.h"
#include "coordinator/measure/compare/error_map.h"

namespace kiln {

// By texel, from 1: the chart that it is of, of several boxes around it the smallest. 0: not measured.
std::vector<uint32_t> chart_labels(const ErrorMap& map, std::vector<ChartRegion> boxes);
// The same of a map without boxes: measured texels that touch are taken to be of one chart.
std::vector<uint32_t> touching_texels(const ErrorMap& map);

// Wang, Bovik, Sheikh & Simoncelli 2004 (Image Quality Assessment: From Error Visibility to Structural
// Similarity, IEEE TIP 13(4)), their window (11 x 11, Gaussian, sigma 1.5) and constants (K1 0.01, K2 0.03):
// the mean over texels that were measured in both maps. Departures: a window holds the texels of its centre's
// chart that were measured in both, and its weights are made to add to 1 over these, since what lies beside a
// chart on the page lies elsewhere in the world; windows of fewer than kMinWindow texels do not count.
// Light is shown as an eye or a display would: L / (L + mean of b), Reinhard et al. 2002 (Photographic Tone
// Reproduction), eq. 3 with the mean for key, then the sRGB curve.
// Nothing where no window counts. Maps as compare_maps takes them.
std::optional<double> structural_similarity(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2);
constexpr int kMinWindow = 16;

}  // namespace kiln
