// Of one texel: where samples are taken instead of from sites inside geometry.
#pragma once

#include <atomic>
#include <optional>
#include <vector>

#include "common/atlas/site_picker.h"
#include "worker/sites/push.h"

namespace kiln {

class SitePlaces {
 public:
  // All outlive this. `hopeless`: what an earlier unit has found of this texel, and what this one finds: it
  // is the same for all.
  SitePlaces(const Surfaces& surfaces, const Tracer& tracer, std::atomic<bool>& hopeless)
      : surfaces_(surfaces), tracer_(tracer), hopeless_(hopeless) {}

  struct Place {
    SurfacePoint point;
    bool moved;  // beside the texel's surface
  };
  // Where to take a sample again that met a back face from point `index` of the texel's `picker`: the next of
  // its points that are asked (at most kAsked, evenly over the texel) which is outside or, where all are
  // inside, a place beside the first that has one. Nothing if the point is outside itself, or if no point is
  // of use: each takes dozens of rays, and a texel inside a wall would ask all of them. A function of scene,
  // texel and point; what was found is kept.
  std::optional<Place> instead_of(SitePicker& picker, uint32_t index, uint64_t& rays);

 private:
  const Pushed& pushed(SitePicker& picker, uint32_t index, uint64_t& rays);

  const Surfaces& surfaces_;
  const Tracer& tracer_;
  std::vector<std::optional<Pushed>> found_;  // by point
  std::atomic<bool>& hopeless_;               // every point that is asked is buried
  static constexpr uint32_t kAsked = 16;
};

}  // namespace kiln
