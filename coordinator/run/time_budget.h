// How the seconds of a limited bake are shared between the passes and what comes after them. What a stage
// takes is known from what this bake has measured, else from its size and the speed of this machine.
#pragma once

#include <algorithm>
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
  // There is no time for any pass, whatever is left out after them. (Where little time went by there is
  // little to be saved by ending now: a small map may still be done.)
  bool is_hopeless() const { return watch_.seconds() > 1 && seconds_left() <= least_seconds_after(); }

  // Whether the map can be denoised, before anything is done for it; from then on it is or is not planned
  // for.
  bool take_time_for_denoiser();
  // The most that may be spent on what texels see (link_by_view); infinite without a limit.
  double views_seconds() const;
  // Are files written the quick way: textures by effort fast, masters without compression?
  bool is_quick() const { return quick_; }
  // Until every texel has a sample, that comes before joined seams and large pictures.
  void set_whole(bool whole) { whole_ = whole; }
  // How coarse the denoiser has to be to end in time (denoise_joined).
  uint32_t denoise_levels() const { return levels_; }
  // Of one run of the denoiser over luminance alone, as passes do it, at these levels.
  double denoise_seconds(uint32_t levels) const;
  void denoise_took(double seconds, uint32_t levels);
  // At the present samples it will run at these levels.
  void denoise_will_be(uint32_t levels) { last_levels_ = std::max(levels, levels_); }
  // So large a share of the sites has texels that the denoiser can join (share_of_large_pieces).
  void surface_is(double joined_share);
  // So many places along seams were found.
  void seams_are(size_t points);

  // After the passes: is there time to join seams, and still for what comes after?
  bool has_time_for_seams() const;
  // By how much the report's pictures must be made smaller, either way, to be done in time: 1, 1/2, 1/4, or 0
  // for no pictures.
  double picture_scale() const;

 private:
  double least_seconds_after() const;
  double seams_seconds() const;
  double textures_seconds(bool seams) const;
  double masters_seconds() const;
  double pictures_seconds(double scale) const;

  const BakeRequest& request_;
  const Stopwatch& watch_;
  void choose_levels();

  double sites_ = 0, texels_ = 0, triangles_ = 0, threads_ = 1, seam_points_ = 0, joined_share_ = 1;
  bool light_ = true;
  double responses_ = 0, response_planes_ = 0;  // planes of their masters
  bool denoises_ = false;
  bool whole_ = true;
  bool quick_ = false;
  bool seams_ = true;    // there will be time for them
  double slowness_ = 1;  // of this machine now, against the idle one that the constants were measured on
  uint32_t levels_ = 0, last_levels_ = 0;  // of the denoiser: at least, and at the end
};

}  // namespace kiln
