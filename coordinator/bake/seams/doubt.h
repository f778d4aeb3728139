// What of the steps at seam points is noise, and what is light.
#pragma once

#include "coordinator/bake/seams/equations.h"

namespace kiln {

// All of it treats both sides of a point alike, so that joining noise keeps the light: no threshold knows
// which side is the brighter.
struct DoubtSettings {
  double model = 0.01;  // of the light: what two sides differ by beyond noise
  // Of the light: steps of which so much is the same at all points that read a texel are closed, whatever the
  // noise. Footprints that a border cuts off make them.
  double cut_off = 0.2;
  // In the noise of a point: steps up to `close` are closed, of larger ones so much; beyond `part` none
  // (a redescending estimate: Hampel 1974, The influence curve).
  double close = 2.5, part = 4;
  // Of what light changes by among the texels that a lookup mixes, noise apart: what two sides may differ by
  // for it. Light that changes within a texel is another a part of a texel further.
  double change = 0.5;
};

struct SeamDoubt {
  double noise = 0;   // of the step, squared, in E
  double excess = 0;  // the step in its noise: of E or of a band of the basis, whichever has more
  double even = 1;    // the part of what is not known of the step that is noise
  double closed = 0;  // the part of the step that is to be closed
  double weight = 0;  // of the equation, 0 to 1
};

// By equation. Noise is what is stated, over 5 x 5 texels of both sides and relative to the light there (of a
// single texel, light and what is stated of it go together); less what both sides share, lookups and
// denoising mix texels; times the light of the darkest texels that the point reads: what is stated in the sun
// excuses nothing in the dark.
std::vector<SeamDoubt> seam_doubts(const Atlas& atlas, const Lightmap& map,
                                   std::span<const SeamEquation> equations, const DoubtSettings& settings);

}  // namespace kiln
