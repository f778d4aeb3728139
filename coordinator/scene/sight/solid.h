// How the coordinator's rays treat a surface: as a viewer or light would.
#pragma once

#include <vector>

#include "common/scene/scene.h"
#include "coordinator/scene/sight/scene_rays.h"

namespace kiln {

class Solid {
 public:
  // `scene` outlives it.
  explicit Solid(const Scene& scene);

  // Whether it blocks light. False for surfaces that cast no shadow or transmit part of the light: glass,
  // alpha.
  bool stops(const RayHit& hit) const { return stops_[hit.instance]; }
  // Whether the hit side is visible. The back of a single-sided surface is black and blocks light.
  bool shows(const RayHit& hit) const { return !hit.back || two_sided_[hit.instance]; }

  // Whether both sides count: double-sided surfaces and glass.
  bool two_sided(uint32_t instance) const { return two_sided_[instance]; }
  bool emits(uint32_t instance) const { return emits_[instance]; }

 private:
  std::vector<uint8_t> stops_, two_sided_, emits_;  // by instance
};

// Unit normal of a triangle with these world-space corners, towards its front by winding.
Vec3 front_normal(const Mat4x3& to_world, const Vec3 (&corner)[3]);

}  // namespace kiln
