// Irradiance of surfaces measured by an earlier pass; a path that hits one may end there.
#pragma once

#include "common/atlas/site_lookup.h"
#include "common/job/irradiance_cache.h"
#include "worker/accel/tracer.h"

namespace kiln {

struct KnownIrradiance {
  const SiteLookup& sites;
  const IrradianceCache& cache;

  // Hits closer than this many texels of the surface hit are traced on: the mean over a texel differs from
  // what a nearby point sees. (Ward et al. 1988 bound reuse by the distance to surfaces likewise.)
  static constexpr float kNearestTexels = 2.0f;
  // A normal map that tilts the normal further than this needs its own irradiance, not the surface's.
  static constexpr float kMinAgreement = 0.9f;

  // Irradiance on the front of the surface hit, or null.
  const Vec3* find(const Hit& hit) const {
    // Half of the hits in a furnished room are this near: most of them need no search for their texel.
    if (!(hit.t > kNearestTexels * sites.least_texel_size(hit.instance))) return nullptr;
    const SiteLookup::Place place = sites.find(hit.instance, hit.triangle, hit.b1, hit.b2);
    if (place.site == SiteLookup::kNone || !(hit.t > kNearestTexels * place.texel_size)) return nullptr;
    const Vec3& e = cache.irradiance[place.site];
    return e.x < 0.0f ? nullptr : &e;
  }
  // The errors drawn of what find() returned.
  CacheDraws draws(const Vec3* found) const {
    return cache.draws.empty() ? CacheDraws{}
                               : cache.draws[static_cast<size_t>(found - cache.irradiance.data())];
  }
};

}  // namespace kiln
