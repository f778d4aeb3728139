// Makes bilinear lookups on both sides of every seam agree.
// After Iwanicki 2013 (Lighting technology of The Last of Us, SIGGRAPH courses): least squares over texels so
// that filtered values match along chart borders. Departures: the borders are found in the world, so that
// objects join one another; all planes share one factor; corrections are smooth and fade out within a few
// texels instead of moving the border's row alone.
#pragma once

#include "coordinator/seams/system.h"

namespace kiln {

struct SeamReport {
  uint64_t stretches = 0, equations = 0, texels = 0;
  double metres = 0;
  // |side 0 - side 1| of the luminance of E relative to the mean of both, at every equation.
  double largest_before = 0, largest_after = 0, rms_before = 0, rms_after = 0;
  // Of measured texels that may move: mean and root mean square of the change of E's luminance in units of
  // their stated error, and the sum of the changes relative to the sum of the values.
  double change_in_errors = 0, rms_change_in_errors = 0, bias = 0;
  uint64_t rounds = 0;        // solves; more than one: some equations needed a higher weight
  uint64_t shortened = 0;     // directions that would have been longer than their light (Lightmap::bounds)
  uint64_t held_at_zero = 0;  // values that would have become negative in a plane that had none such
  double residual = 0;        // of the linear system, relative
};

// Changes every plane but "error" and "samples". The stated error stays that of the measurement.
// Texels further than weights.reach from a seam, and everything where nothing differs, keep their bits. A
// plane without a negative value near seams gets none; values stay finite.
SeamReport join_seams(Lightmap& map, const Scene& scene, const Atlas& atlas, const SeamSettings& settings,
                      const SeamWeights& weights = {});

}  // namespace kiln
