#include "common/math/trig.h"
#include "coordinator/scene/density/factors.h"

namespace kiln {
namespace {

constexpr double kMin = 1.0 / 16;  // minimum factor by distance and by size

// Whether the camera may see part of the bounds: false if all corners are behind it or outside one side of
// its frustum.
bool in_view(const Bounds& bounds, const Viewpoint& camera) {
  const SinCos half = sincos_turns(camera.vertical_fov * (0.25f * kInvPi));
  const double tangent_y = double{half.sin} / half.cos, tangent_x = tangent_y * camera.aspect;
  bool behind = true, left = true, right = true, below = true, above = true;
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 d =
        DVec3(corner & 1 ? bounds.high.x : bounds.low.x, corner & 2 ? bounds.high.y : bounds.low.y,
              corner & 4 ? bounds.high.z : bounds.low.z) -
        DVec3(camera.to_world[3]);
    const double x = dot(d, DVec3(camera.to_world[0])), y = dot(d, DVec3(camera.to_world[1])),
                 depth = -dot(d, DVec3(camera.to_world[2]));
    behind &= depth < 0;
    left &= x < -tangent_x * depth;
    right &= x > tangent_x * depth;
    below &= y < -tangent_y * depth;
    above &= y > tangent_y * depth;
  }
  return !(behind || left || right || below || above);
}

}  // namespace

double view_factor(const Bounds& bounds, const std::vector<Viewpoint>& cameras, double distance,
                   double unseen) {
  double most = 0;
  for (const Viewpoint& camera : cameras) {
    const double away = bounds.distance(DVec3(camera.to_world[3]));
    double factor = away > distance ? std::max(kMin, distance / away) : 1.0;
    if (factor <= most) continue;
    if (unseen < 1 && !in_view(bounds, camera)) factor = std::max(kMin, factor * unseen);
    most = std::max(most, factor);
  }
  return cameras.empty() ? 1.0 : most;
}

double size_factor(const Bounds& bounds, double small) {
  const double size = bounds.diagonal();
  return size < small ? std::max(kMin, size / small) : 1.0;
}

double to_step(double factor) {
  constexpr double kStep = 0.84089641525371454303;      // 2^(-1/4)
  constexpr double kHalfStep = 0.91700404320467123174;  // 2^(-1/8)
  double step = 1;
  for (int k = 0; k < 24 && factor < step * kHalfStep; ++k) step *= kStep;
  return step;
}

}  // namespace kiln
