// For texel sites inside geometry (a floor under a crate, or where a wall passes through it): finds the
// nearest point outside.
#pragma once

#include <optional>

#include "worker/accel/tracer.h"
#include "worker/surface/surfaces.h"

namespace kiln {

enum class Side : uint8_t {
  kOpen,     // sees few back faces: may replace other points
  kOutside,  // does not mostly see back faces
  kInside
};

// Classifies a site. Depends only on scene and site, so all units get the same result. Traces at most 12
// rays, added to `rays`.
Side side_of(const Surfaces& surfaces, const Tracer& tracer, const SurfacePoint& site, uint64_t& rays);

// The point to sample instead of a site inside; nullopt if no outside point is near enough. `texel_size`:
// side of a texel in metres. At most 55 rays; otherwise like side_of.
//
// The push of lightmappers (O'Donnell 2018 discards such texels; Godot's baker moves them): rays along the
// tangent plane find back faces, which are the exits. A point behind the nearest exit, an eighth of a texel
// off it or half way to the next hit, is used if it does not mostly see back faces itself.
std::optional<Vec3> way_out(const Surfaces& surfaces, const Tracer& tracer, const SurfacePoint& site,
                            float texel_size, uint64_t& rays);

}  // namespace kiln
