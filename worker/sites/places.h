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
  // kAsked of its points, evenly over the texel, that is open; where none is, a place beside the first of
  // kMoved of them that has one; else the next that is at least outside. Nothing if the point is not inside,
  // or if no point is of use. A function of scene, texel and point; what was found is kept: most texels
  // inside walls are inside with all of their points, which takes some hundred rays to know, once a worker.
  std::optional<Place> instead_of(SitePicker& picker, uint32_t index, uint64_t& rays);

 private:
  static constexpr uint32_t kAsked = 16, kMoved = 4;

  SurfacePoint at(SitePicker& picker, uint32_t index) const;
  Side side(SitePicker& picker, uint32_t index, uint64_t& rays);
  const std::optional<Vec3>& moved(SitePicker& picker, uint32_t index, uint64_t& rays);

  const Surfaces& surfaces_;
  const Tracer& tracer_;
  std::vector<std::optional<Side>> side_;                  // by point
  std::vector<std::optional<std::optional<Vec3>>> moved_;  // by point
  std::atomic<bool>& hopeless_;                            // no point is of use
};

}  // namespace kiln
