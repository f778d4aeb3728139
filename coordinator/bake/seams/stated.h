// What a move does to the stated error.
#pragma once

#include "coordinator/bake/seams/system.h"

namespace kiln {

// A texel that was measured with the standard error s and is moved by d states sqrt(max(s^2, s^2 / 2 + d^2)).
// If the step was noise, the two sides agree on their mean, whose variance is half of s^2 whatever d is (the
// sum and the difference of two independent errors of one size are independent); if it was not, all of d is
// wrong. Which of the two it was is not known: d counts in full, and nothing gets less than it stated.
double stated_after_move(double stated, double moved);

// Planes of the map as they were, by unknown: [plane][unknown], for the planes in `planes`.
struct SeamBackup {
  std::vector<size_t> planes;
  std::vector<std::vector<float>> values;
};
SeamBackup back_up(const Lightmap& map, std::span<const uint32_t> texels);

// Brings the plane "error" and the errors of bands up to what texels were moved by. Moves of colours count by
// their sizes, so that those that cancel in the luminance are not lost.
void state_moves(Lightmap& map, std::span<const uint32_t> texels, const SeamBackup& before);

}  // namespace kiln
