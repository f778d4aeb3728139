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
  // The surface graph was made in so many seconds: how fast this machine is at present.
  void neighbours_took(double seconds);

  // Is there time for the report's pictures at this share of their width? What comes after them has its own.
  bool has_time_for_pictures(double share) const;

 private:
  const BakeRequest& request_;
  const Stopwatch& watch_;
  double sites_ = 0, texels_ = 0, threads_ = 1, neighbours_ = 0;
  double slowness_ = 1;  // of this machine, against the one the constants were measured on
  double denoise_ = 0;
};

}  // namespace kiln
