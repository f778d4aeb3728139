// How much of a scene a view shows.
#pragma once

#include <optional>
#include <vector>

#include "coordinator/output/look/surface_look.h"
#include "coordinator/scene/import/import.h"
#include "coordinator/scene/sight/scene_rays.h"

namespace kiln {

// What one direction of a view shows.
struct Sight {
  enum class Kind : uint8_t { kNothing, kFront, kBack } kind = Kind::kNothing;
  float distance = 0;
  uint32_t object = 0;  // instance
  uint64_t plane = 0;   // equal for points of one flat surface
  float light = 0;      // luminance of E; negative: not known
};

// Looks along rays, and names what is there.
class Watcher {
 public:
  // `size`: of the scene, metres; planes nearer to each other than a fraction of it are one.
  Watcher(const Scene& scene, const SurfaceLook& look, const SceneRays& rays, float size)
      : scene_(scene), look_(look), rays_(rays), size_(size) {}
  Sight along(const Vec3& origin, const Vec3& direction) const;
  // Of width x height rays through a picture of 16 to 9.
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

// 0 to 1: many objects and surfaces, at varied distance, far ones too, in light and shadow, from their
// fronts. `usual`: the median luminance of E in the map; `size`: of the scene, metres. A view of back faces,
// of darkness, or of a wall before the lens is near 0.
double view_score(const std::vector<Sight>& sights, float usual, double size);

// Does it show anything to judge a lightmap by? For cameras of the file.
bool shows_something(const std::vector<Sight>& sights);

}  // namespace kiln
