// Probes: points that lie on no surface and gather light from the whole sphere.
#pragma once

#include "common/probes/probe_points.h"
#include "worker/bake/probe_film.h"
#include "worker/bake/receivers.h"
#include "worker/integrators/dimensions.h"

namespace kiln {

class ProbeReceivers {
 public:
  explicit ProbeReceivers(ProbePoints points) : points_(std::move(points.points)) {}
  size_t size() const { return points_.size(); }
  uint32_t key(uint32_t index) const { return index; }
  using Sums = ProbeFilm;

  // The hemisphere of a sample is the half of the sphere that its direction falls into
  // (PrimaryDensity::kSphere), so lights are sampled in that half as at any surface.
  class Open {
   public:
    Open(const ProbeReceivers& r, const Surfaces&, const Tracer&, uint32_t index)
        : point_(r.points_[index]) {}
    SurfacePoint at(const SampleStream& stream) const {
      SurfacePoint p{};
      p.position = point_.position;
      p.ng = p.ns = Vec3(0, is_upper_half(stream.pair(dimension(0, kDirection))) ? 1 : -1, 0);
      return p;
    }
    std::optional<SitePlaces::Place> instead_of(const SampleStream&, uint64_t&) const { return std::nullopt; }
    float reach() const { return point_.reach; }

   private:
    ProbePoint point_;
  };
  std::optional<KnownIrradiance> known(const Scene&, const IrradianceCache&) const { return std::nullopt; }
  // The scene was moved by this (recentre.h).
  void move(const Vec3& offset) {
    for (ProbePoint& p : points_) p.position += offset;
  }

 private:
  std::vector<ProbePoint> points_;
};
static_assert(ReceiverKind<ProbeReceivers>);

}  // namespace kiln
