// Separates noise from light in the steps at seam points.
#pragma once

#include "coordinator/bake/seams/equations.h"

namespace kiln {

// Both sides of a point are treated alike, so that closing noise preserves the light: no threshold depends on
// which side is brighter.
struct DoubtSettings {
  double model = 0.01;  // relative to the light: difference of two sides beyond noise
  // Relative to the light: a step up to this size that all points reading a texel have in common is closed,
  // whatever the noise. Footprints cut off by a border cause such steps.
  double cut_off = 0.2;
  // In units of a point's noise: steps up to `close` are closed, larger ones by that amount, and beyond
  // `part` not at all (a redescending estimator: Hampel 1974, The influence curve).
  double close = 2.5, part = 4;
  // Allowed difference of two sides, as a share of how much the light varies among the texels of a lookup,
  // noise excluded. Light that varies within a texel differs a fraction of a texel further on.
  double change = 0.5;
};

struct SeamDoubt {
  double noise = 0;   // variance of the step, in E squared
  double excess = 0;  // the step in units of its noise, of E or of a band of the basis, whichever is larger
  double even = 1;    // share of the step's uncertainty that is noise
  double closed = 0;  // share of the step to close
  double weight = 0;  // of the equation, 0 to 1
};

// By equation. Noise is the reported error over 5 x 5 texels of both sides, relative to the light there (in a
// single texel the two are correlated), minus the part both sides share, because lookups and denoising mix
// texels, times the light of the darkest texels that the point reads: error in the sun does not excuse a step
// in the dark.
std::vector<SeamDoubt> seam_doubts(const Atlas& atlas, const Lightmap& map,
                                   std::span<const SeamEquation> equations, const DoubtSettings& settings);

}  // namespace kiln
