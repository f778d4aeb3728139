// Makes bilinear lookups on both sides of every seam agree.
// After Iwanicki 2013 (Lighting technology of The Last of Us, SIGGRAPH courses): least squares over texels so
// that filtered values match along chart borders. Departures: the borders are found in the world, so that
// objects join one another; all planes share one factor; steps larger than both sides' reported errors stay;
// the correction of a texel enters its reported error.
#pragma once

#include "coordinator/bake/seams/steps.h"
#include "coordinator/bake/seams/system.h"

namespace kiln {

struct SeamReport {
  uint64_t stretches = 0, equations = 0, texels = 0;
  double metres = 0;
  SeamSteps before, after;
  SeamSteps agreed;  // after, where the sides differed by no more than noise before
  double apart = 0;  // share of the seams' length where they differed by more
  // Over measured texels that may change: mean and root mean square of the change of E's luminance in units
  // of the reported error, and the sum of changes relative to the sum of values.
  double change_in_errors = 0, rms_change_in_errors = 0, bias = 0;
  uint64_t shortened = 0;     // directions clamped to the length of their light (Lightmap::bounds)
  uint64_t held_at_zero = 0;  // values clamped at zero in a plane that had no negative value
  double residual = 0;        // of the linear system, relative
};

// Changes every plane but "samples"; "error" and the errors of bands as in stated.h.
// Texels further than weights.reach from a seam, and everything where nothing differs, keep their bits. A
// plane without negative values near seams gets none; values stay finite.
SeamReport join_seams(Lightmap& map, SeamFinder& finder, const SeamSettings& settings,
                      const SeamWeights& weights = {});
SeamReport join_seams(Lightmap& map, const Scene& scene, const Atlas& atlas, const SeamSettings& settings,
                      const SeamWeights& weights = {});

// The equations that join_seams would solve, in order, for measurements.
std::vector<SeamEquation> seams_of(const Lightmap& map, const Scene& scene, const Atlas& atlas,
                                   const SeamSettings& settings);

}  // namespace kiln
