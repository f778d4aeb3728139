// Of one texel: where samples are taken instead of from sites inside geometry.
#pragma once

#include <optional>
#include <vector>

#include "common/atlas/site_picker.h"
#include "worker/sites/push.h"

namespace kiln {

class SitePlaces {
 public:
  // Both outlive this.
  SitePlaces(const Surfaces& surfaces, const Tracer& tracer) : surfaces_(surfaces), tracer_(tracer) {}

  struct Place {
    SurfacePoint point;
    bool moved;  // beside the texel's surface
  };
  // Where to take a sample again that met a back face from point `index` of the texel's `picker`: the next
  // point of the texel that is outside or, where all are inside, a place beside the first that has one.
  // Nothing if the point is outside itself, or if no point of the texel is of use. A function of scene and
  // texel; what was found is kept.
  std::optional<Place> instead_of(SitePicker& picker, uint32_t index, uint64_t& rays);

 private:
  const Pushed& pushed(SitePicker& picker, uint32_t index, uint64_t& rays);

  const Surfaces& surfaces_;
  const Tracer& tracer_;
  std::vector<std::optional<Pushed>> found_;  // by point
  bool hopeless_ = false;                     // every point is buried
};

}  // namespace kiln
