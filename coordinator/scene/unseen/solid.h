// What a ray of the coordinator meets as a viewer or light does.
#pragma once

#include <vector>

#include "common/scene/scene.h"
#include "coordinator/scene/sight/scene_rays.h"

namespace kiln {

class Solid {
 public:
  // `scene` outlives it.
  explicit Solid(const Scene& scene);

  // Does it stop light? Not what casts no shadow, nor what lets a part of the light through: glass, alpha.
  bool stops(const RayHit& hit) const { return stops_[hit.instance]; }
  // Is the side that the ray meets one that shows something? The back of a single-sided surface is black and
  // lets no light through.
  bool shows(const RayHit& hit) const { return !hit.back || two_sided_[hit.instance]; }

  // Both sides have air that counts: double-sided, and glass.
  bool two_sided(uint32_t instance) const { return two_sided_[instance]; }
  bool emits(uint32_t instance) const { return emits_[instance]; }

 private:
  std::vector<uint8_t> stops_, two_sided_, emits_;  // by instance
};

// Unit, of a triangle with these corners in the world, to the side that its winding calls front.
Vec3 front_normal(const Mat4x3& to_world, const Vec3 (&corner)[3]);

}  // namespace kiln
