#include "coordinator/scene/density/factors.h"

namespace kiln {
namespace {

bool triangle_touches(const Scene& scene, const Instance& instance, const ImportanceBox& box) {
  const Mesh& mesh = scene.meshes[instance.mesh];
  for (const UVec3& t : mesh.triangles) {
    Bounds bounds;
    for (int k = 0; k < 3; ++k) bounds.add(DVec3(transform_point(instance.to_world, mesh.positions[t[k]])));
    if (bounds.touches(box.low, box.high)) return true;
  }
  return false;
}

bool applies(const Scene& scene, const Instance& instance, const Bounds& bounds, const ImportanceBox& box) {
  if (bounds.inside(box.low, box.high)) return true;
  return box.factor > 1 && bounds.touches(box.low, box.high) && triangle_touches(scene, instance, box);
}

}  // namespace

int box_of(const Scene& scene, const Instance& instance, const Bounds& bounds,
           const std::vector<ImportanceBox>& boxes) {
  int best = -1;
  for (size_t b = 0; b < boxes.size(); ++b)
    if ((best < 0 || boxes[b].factor > boxes[static_cast<size_t>(best)].factor) &&
        applies(scene, instance, bounds, boxes[b]))
      best = static_cast<int>(b);
  return best;
}

}  // namespace kiln
