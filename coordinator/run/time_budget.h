// How the seconds of a time-limited bake are split between passes and later stages. A stage's time
// is predicted from what this bake has measured, otherwise from its size and this machine's speed.
#pragma once

#include <algorithm>
#include <limits>

#include "common/base/clock.h"
#include "coordinator/run/bake_run.h"

namespace kiln {

class TimeBudget {
 public:
  // `watch`: started with the bake; must outlive this.
  TimeBudget(const BakeRequest& request, const Preflight& preflight, const Stopwatch& watch);

  double seconds_for_passes() const;  // from now; infinite without a limit
  double seconds_after() const;       // all stages after the passes
  double seconds_left() const;        // whole bake; infinite without a limit
  // Whether there is no time for any pass, even with everything optional left out. (Early in a
  // bake, ending saves little: a small map may still finish.)
  bool is_hopeless() const { return watch_.seconds() > 1 && seconds_left() <= least_seconds_after(); }

  // Decides, before any work for it, whether the map can be denoised; the decision then holds for
  // planning.
  bool take_time_for_denoiser();
  // Maximum time for finding what texels see (link_by_view); infinite without a limit.
  double views_seconds() const;
  // The same for finding texels that mislead paths (half_hidden_sites).
  double hidden_seconds() const;
  // Whether files are written the quick way: textures with effort fast, masters uncompressed.
  bool is_quick() const { return quick_; }
  // Until every texel has a sample, sampling has priority over joined seams and large pictures.
  void set_whole(bool whole) { whole_ = whole; }
  // How coarse the denoiser must be to end in time (denoise_joined).
  uint32_t denoise_levels() const { return levels_; }
  // One run of the denoiser over luminance alone at these levels, as between passes.
  double denoise_seconds(uint32_t levels) const;
  void denoise_took(double seconds, uint32_t levels);
  // With the present samples the last run will use these levels.
  void denoise_will_be(uint32_t levels) { last_levels_ = std::max(levels, levels_); }
  // Share of the sites whose texels the denoiser can join (share_of_large_pieces).
  void surface_is(double joined_share);
  // Number of seam points found.
  void seams_are(size_t points);

  // After the passes: whether there is time to join seams and for all later stages.
  bool has_time_for_seams() const;
  // Scale of the report's pictures, per side, to finish in time: 1, 1/2, 1/4, or 0 for no pictures.
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
  bool seams_ = true;    // whether seams are planned
  double slowness_ = 1;  // of this machine now, relative to the idle one on which the constants were measured
  double denoise_slowness_ = 1;            // of the denoiser on this map, beyond that of the machine
  uint32_t levels_ = 0, last_levels_ = 0;  // denoiser levels: minimum, and for the last run
};

}  // namespace kiln
