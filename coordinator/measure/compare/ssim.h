// Structural similarity of two maps.
#pragma once

#include "coordinator/measure/compare/chart_boxes.h"
#include "coordinator/measure/compare/error_map.h"

namespace kiln {

// By texel: its chart, from 1; of several boxes around it the smallest. 0: not measured.
std::vector<uint32_t> chart_labels(const ErrorMap& map, std::vector<ChartRegion> boxes);
// The same for a map without boxes: connected measured texels count as one chart.
std::vector<uint32_t> touching_texels(const ErrorMap& map);

// Wang, Bovik, Sheikh & Simoncelli 2004 (Image Quality Assessment: From Error Visibility to
// Structural Similarity, IEEE TIP 13(4)) with their window (11 x 11, Gaussian, sigma 1.5) and
// constants (K1 0.01, K2 0.03): the mean over texels that were measured in both maps. Departures: a
// window contains the texels of its centre's chart that were measured in both, and its weights are
// normalised over these, since neighbours on the page may be far apart in the world; windows of
// fewer than kMinWindow texels do not count. Light is compared as displayed: L / (L + mean of b),
// Reinhard et al. 2002 (Photographic Tone Reproduction), eq. 3 with the mean as key, then the sRGB
// curve. Nothing if no window counts. Same requirements as compare_maps.
std::optional<double> structural_similarity(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2);
constexpr int kMinWindow = 16;

}  // namespace kiln
