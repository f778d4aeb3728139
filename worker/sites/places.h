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

  // Where to take a sample again that met a back face from point `index` of the texel's `picker`: a place
  // beside the point or, where there is none, the next point of the texel that is outside or has one, so that
  // sites without a place do not darken a texel that has others. Nothing if the point is outside, or if no
  // point of the texel is of use. A function of scene and texel; what was found is kept.
  std::optional<SurfacePoint> instead_of(SitePicker& picker, uint32_t index, uint64_t& rays);

 private:
  const Pushed& pushed(SitePicker& picker, uint32_t index, uint64_t& rays);

  const Surfaces& surfaces_;
  const Tracer& tracer_;
  std::vector<std::optional<Pushed>> found_;  // by point
  bool hopeless_ = false;                     // every point is buried
};

}  // namespace kiln
