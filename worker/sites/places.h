// Replacement sample points of one texel, for sites inside geometry.
#pragma once

#include <atomic>
#include <optional>
#include <vector>

#include "common/atlas/site_picker.h"
#include "worker/sites/push.h"

namespace kiln {

class SitePlaces {
 public:
  // Arguments outlive this. `hopeless`: shared between units; set if no point of this texel is usable.
  SitePlaces(const Surfaces& surfaces, const Tracer& tracer, std::atomic<bool>& hopeless)
      : surfaces_(surfaces), tracer_(tracer), hopeless_(hopeless) {}

  struct Place {
    SurfacePoint point;
    bool moved;  // off the texel's surface
  };
  // Where to repeat a sample from point `index` of the texel's `picker` that hit a back face: the next open
  // one of kAsked of its points, spread over the texel; if none is open, a point beside the first of kMoved
  // of them that has one; else the next that is at least outside. nullopt if the point is not inside, or if
  // no point is usable. A pure function of scene, texel and point. Results are cached because most texels
  // inside walls have all their points inside, and finding that out takes about a hundred rays per worker.
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
  std::atomic<bool>& hopeless_;                            // no point is usable
};

}  // namespace kiln
