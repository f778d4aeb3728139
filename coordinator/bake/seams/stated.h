// The effect of a correction on the reported error.
#pragma once

#include "coordinator/bake/seams/system.h"

namespace kiln {

// A texel measured with standard error s and corrected by d reports sqrt(max(s^2, s^2 / 2 + d^2)). If the
// step was noise, the two sides agree on their mean, whose variance is s^2 / 2 whatever d is (the sum and the
// difference of two independent errors of equal size are independent); if it was not, d is all error. Which
// one holds is unknown, so d counts in full and the reported error never falls.
double stated_after_move(double stated, double moved);

// Planes of the map before the corrections: [plane][unknown], for the planes in `planes`.
struct SeamBackup {
  std::vector<size_t> planes;
  std::vector<std::vector<float>> values;
};
SeamBackup back_up(const Lightmap& map, std::span<const uint32_t> texels);

// Updates the plane "error" and the errors of bands for the corrections. Corrections of colours count by
// magnitude, so that those that cancel in the luminance are not lost.
void state_moves(Lightmap& map, std::span<const uint32_t> texels, const SeamBackup& before);

}  // namespace kiln
