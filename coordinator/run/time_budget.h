// How the seconds of a limited bake are shared between the passes and what comes after them. What a stage
// takes is known from what this bake has measured, else from its size and the speed of this machine.
#pragma once

#include <limits>

#include "common/base/clock.h"
#include "coordinator/run/bake_run.h"

namespace kiln {

class TimeBudget {
 public:
  // `watch`: began with the bake; outlives this.
  TimeBudget(const BakeRequest& request, const Preflight& preflight, const Stopwatch& watch);

  double seconds_for_passes() const;  // from now; infinite without a limit
  double seconds_after() const;       // of all stages after the passes
  double seconds_left() const;        // of the whole bake; infinite without a limit

  // Of one run of the denoiser over luminance alone, as passes do it.
  double denoise_seconds() const { return denoise_; }
  void denoise_took(double seconds);
  // The surface graph was made in so many seconds; joining seams begins with the same search.
  void neighbours_took(double seconds);

  // After the passes: is there time to join seams, and still for what comes after?
  bool has_time_for_seams() const;
  // By how much the report's pictures must be made smaller, either way, to be done in time: 1, 1/2, 1/4, or 0
  // for no pictures.
  double picture_scale() const;

 private:
  double seams_seconds() const;
  double textures_seconds(bool seams) const;
  double masters_seconds() const;
  double pictures_seconds(double scale) const;

  const BakeRequest& request_;
  const Stopwatch& watch_;
  double sites_ = 0, texels_ = 0, threads_ = 1, neighbours_ = 0;
  bool seams_ = true;    // there will be time for them
  double slowness_ = 1;  // of this machine now, against the idle one that the constants were measured on
  double denoise_ = 0;
};

}  // namespace kiln
