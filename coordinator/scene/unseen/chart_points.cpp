#include "coordinator/scene/unseen/chart_points.h"

#include <algorithm>

#include "common/math/sequence.h"
#include "common/math/warp.h"
#include "coordinator/scene/sight/solid.h"

namespace kiln {

ChartSurface::ChartSurface(const Scene& scene, const Atlas& atlas, uint32_t instance,
                           std::span<const uint32_t> faces)
    : scene_(scene), charts_(atlas.of_instance(instance)), instance_(instance) {
  const Instance& object = scene.instances[instance];
  double sum = 0;
  for (const uint32_t face : faces) {
    if (area2(uv_triangle(charts_, face)) == 0) continue;  // has no texels
    Vec3 c[3];
    face_corners(scene.meshes[object.mesh], charts_, face, c);
    const double area = double{length(cross(transform_vector(object.to_world, c[1] - c[0]),
                                            transform_vector(object.to_world, c[2] - c[0])))};
    if (!(area > 0)) continue;
    faces_.push_back(face);
    area_.push_back(sum += area);
  }
}

ChartPoint ChartSurface::at(size_t face, float b1, float b2) const {
  const Instance& object = scene_.instances[instance_];
  Vec3 c[3];
  face_corners(scene_.meshes[object.mesh], charts_, face, c);
  const Vec3 point = c[0] + b1 * (c[1] - c[0]) + b2 * (c[2] - c[0]);
  return {transform_point(object.to_world, point), front_normal(object.to_world, c),
          charts_.triangle_of(face)};
}

ChartPoint ChartSurface::spread(uint32_t k, uint32_t count, uint64_t key) const {
  const double share = (static_cast<double>(k) + 0.5) / count;
  const auto found = std::lower_bound(area_.begin(), area_.end(), share * area_.back());
  const auto face = std::min<size_t>(static_cast<size_t>(found - area_.begin()), faces_.size() - 1);
  const Vec2 b = uniform_triangle(SampleStream(key, 0, k).pair(0));
  return at(faces_[face], b.x, b.y);
}

std::vector<ChartPoint> ChartSurface::corners(size_t most) const {
  constexpr float kInside = 0.03f;
  std::vector<ChartPoint> points;
  const size_t step = (3 * faces_.size() + most - 1) / most;
  for (size_t c = 0; c < 3 * faces_.size(); c += step) {
    const size_t k = c % 3;
    points.push_back(
        at(faces_[c / 3], k == 1 ? 1 - 2 * kInside : kInside, k == 2 ? 1 - 2 * kInside : kInside));
  }
  return points;
}

}  // namespace kiln
