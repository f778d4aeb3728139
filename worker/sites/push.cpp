#include "worker/sites/push.h"

#include <algorithm>
#include <array>

#include "common/math/frame.h"
#include "common/math/warp.h"

namespace kiln {
namespace {

constexpr float kReach = 2.0f;     // texels; further than a bilinear lookup reads under an object
constexpr float kMargin = 0.125f;  // texels between the point and the exit
constexpr int kRing = 16;          // directions in the tangent plane
constexpr int kProbes = 12;        // directions that decide whether a point is inside
constexpr size_t kTries = 3;       // exits tested, nearest first

class Push {
 public:
  Push(const Surfaces& surfaces, const Tracer& tracer, const SurfacePoint& site, uint64_t& rays)
      : surfaces_(surfaces), tracer_(tracer), site_(site), frame_(site.ng), rays_(rays) {}

  Side side() {
    const int backs = back_faces_from(site_.position);
    return 2 * backs > kProbes ? Side::kInside : 4 * backs > kProbes ? Side::kOutside : Side::kOpen;
  }

  std::optional<Vec3> way_out(float texel_size) {
    std::array<Exit, kRing> exits;
    const size_t found = find_exits(kReach * texel_size, exits);
    for (size_t i = 0; i < std::min(found, kTries); ++i)
      if (const auto place = beyond(exits[i], kMargin * texel_size);
          place && 2 * back_faces_from(*place) <= kProbes)
        return place;
    return std::nullopt;
  }

 private:
  struct Exit {
    SurfacePoint at;
    float distance;
  };

  Hit trace(const Ray& ray) {
    ++rays_;
    return tracer_.intersect(ray, 0);
  }
  // Whether `hit` is the back of an opaque single-sided surface.
  bool is_back(const Hit& hit, const Vec3& direction, SurfacePoint& at) const {
    if (!hit.valid()) return false;
    const SurfaceKind& kind = surfaces_.kind(hit.instance);
    if (kind.double_sided || kind.glass) return false;
    at = surfaces_.at(hit.instance, hit.triangle, hit.b1, hit.b2);
    return dot(direction, at.ng) > 0.0f;
  }

  // Back faces along the tangent plane within `reach`, nearest first; ties go to the earlier
  // direction.
  size_t find_exits(float reach, std::array<Exit, kRing>& exits) {
    const Vec3 origin = offset_origin(site_.position, site_.ng, site_.error);
    size_t found = 0;
    for (int k = 0; k < kRing; ++k) {
      const Vec3 d = frame_.to_world(spherical(0.0f, (static_cast<float>(k) + 0.5f) / kRing));
      const Hit hit = trace({origin, d, reach});
      if (is_back(hit, d, exits[found].at)) exits[found++].distance = hit.t;
    }
    std::stable_sort(exits.begin(), exits.begin() + static_cast<std::ptrdiff_t>(found),
                     [](const Exit& a, const Exit& b) { return a.distance < b.distance; });
    return found;
  }

  // Counts back-face hits of a fixed set of kProbes rays over the hemisphere, stopping above half. The
  // heights are quantiles of the primary ray density, so that the result matches the texel's samples.
  int back_faces_from(const Vec3& position) {
    constexpr float kHeights[3] = {0.264f, 0.618f, 0.884f};
    const Vec3 origin = offset_origin(position, site_.ng, site_.error);
    int backs = 0;
    SurfacePoint at;
    for (int k = 0; k < kProbes && 2 * backs <= kProbes; ++k) {
      const Vec3 d = frame_.to_world(spherical(kHeights[k % 3], (static_cast<float>(k) + 0.25f) / kProbes));
      backs += is_back(trace({origin, d}), d, at);
    }
    return backs;
  }

  // A point on the outer side of an exit, in the tangent plane, with nothing between it and the exit.
  std::optional<Vec3> beyond(const Exit& exit, float margin) {
    const Vec3 flat = exit.at.ng - site_.ng * dot(exit.at.ng, site_.ng);
    if (!(length(flat) > 1e-3f)) return std::nullopt;  // a back face parallel to the plane is not an exit
    const Vec3 away = flat / length(flat);
    const Vec3 origin = offset_origin(exit.at.position, exit.at.ng, exit.at.error);
    const Hit next = trace({origin, away, margin});
    return origin + away * (next.valid() ? 0.5f * next.t : margin);
  }

  const Surfaces& surfaces_;
  const Tracer& tracer_;
  const SurfacePoint& site_;
  const Frame frame_;
  uint64_t& rays_;
};

}  // namespace

Side side_of(const Surfaces& surfaces, const Tracer& tracer, const SurfacePoint& site, uint64_t& rays) {
  return Push(surfaces, tracer, site, rays).side();
}

std::optional<Vec3> way_out(const Surfaces& surfaces, const Tracer& tracer, const SurfacePoint& site,
                            float texel_size, uint64_t& rays) {
  return Push(surfaces, tracer, site, rays).way_out(texel_size);
}

}  // namespace kiln
