// Surfaces whose irradiance an earlier pass has measured: a path that meets one need not go on.
#pragma once

#include "common/atlas/site_lookup.h"
#include "common/job/irradiance_cache.h"
#include "worker/accel/tracer.h"

namespace kiln {

struct KnownIrradiance {
  const SiteLookup& sites;
  const IrradianceCache& cache;

  // Hits nearer than this many texels of the surface that was met go on: the mean over a texel is not what a
  // point beside it sees. (Ward et al. 1988 bound reuse by the distance of surfaces likewise.)
  static constexpr float kNearestTexels = 4.0f;
  // A normal map that turns the normal further than this asks for another irradiance than the surface's own.
  static constexpr float kMinAgreement = 0.9f;

  // Irradiance of the front of the surface that was met, or null.
  const Vec3* find(const Hit& hit) const {
    const SiteLookup::Place place = sites.find(hit.instance, hit.triangle, hit.b1, hit.b2);
    if (place.site == SiteLookup::kNone || !(hit.t > kNearestTexels * place.texel_size)) return nullptr;
    const Vec3& e = cache.irradiance[place.site];
    return e.x < 0.0f ? nullptr : &e;
  }
};

}  // namespace kiln
