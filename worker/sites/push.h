// Texel sites that lie inside geometry (a floor under a crate, the foot of a wall that goes through it): the
// nearest place beside them that is outside.
#pragma once

#include <optional>

#include "worker/accel/tracer.h"
#include "worker/surface/surfaces.h"

namespace kiln {

enum class Side : uint8_t {
  kOpen,     // sees few back faces: it may stand for others
  kOutside,  // does not mostly see back faces
  kInside
};

// Where a site lies. Depends on the scene and the site alone: all units that ask get the same answer. At most
// 12 rays, added to `rays`.
Side side_of(const Surfaces& surfaces, const Tracer& tracer, const SurfacePoint& site, uint64_t& rays);

// Where to sample instead of a site inside; nothing where nothing outside is near enough. `texel_size` is a
// texel's side in metres. At most 55 rays; otherwise as side_of.
//
// The push of lightmappers (O'Donnell 2018 discards such texels; Godot's baker moves them): rays along the
// tangent plane look for back faces, which are the way out. A place behind the nearest one, an eighth of a
// texel off it or half way to what comes next, is taken if it does not mostly see back faces itself.
std::optional<Vec3> way_out(const Surfaces& surfaces, const Tracer& tracer, const SurfacePoint& site,
                            float texel_size, uint64_t& rays);

}  // namespace kiln
