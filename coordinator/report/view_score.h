// Scores how much of a scene a view shows.
#pragma once

#include <optional>
#include <vector>

#include "coordinator/output/look/surface_look.h"
#include "coordinator/scene/import/import.h"
#include "coordinator/scene/sight/scene_rays.h"

namespace kiln {

// What is visible in one direction of a view.
struct Sight {
  enum class Kind : uint8_t { kNothing, kFront, kBack } kind = Kind::kNothing;
  float distance = 0;
  uint32_t object = 0;  // instance
  uint64_t plane = 0;   // equal for points on the same flat surface
  float light = 0;      // luminance of E; negative: unknown
};

// Traces rays and identifies what they hit.
class Watcher {
 public:
  // `size`: of the scene, metres; planes closer together than a fraction of it count as one.
  Watcher(const Scene& scene, const SurfaceLook& look, const SceneRays& rays, float size)
      : scene_(scene), look_(look), rays_(rays), size_(size) {}
  Sight along(const Vec3& origin, const Vec3& direction) const;
  // Traces width x height rays through a 16:9 picture.
  std::vector<Sight> view(const Camera& camera, uint32_t width, uint32_t height) const;
  // Distance to the nearest surface, at most `far`.
  float free_way(const Vec3& origin, const Vec3& direction, float far) const;

 private:
  bool solid(const RayHit& hit) const;

  const Scene& scene_;
  const SurfaceLook& look_;
  const SceneRays& rays_;
  float size_;
};

// Score in [0, 1]: high for many objects and surfaces at varied distances, some far, in light and
// shadow, seen from the front. `usual`: the map's median luminance of E; `size`: of the scene,
// metres. A view of back faces, darkness, or a wall in front of the lens is near 0.
double view_score(const std::vector<Sight>& sights, float usual, double size);

// Whether the view shows anything to judge a lightmap by. For cameras of the file.
bool shows_something(const std::vector<Sight>& sights);

}  // namespace kiln
