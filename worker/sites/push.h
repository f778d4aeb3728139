// Texel sites that lie inside geometry (a floor under a crate, the foot of a wall that goes through it): the
// nearest place beside them that is outside.
#pragma once

#include "worker/accel/tracer.h"
#include "worker/surface/surfaces.h"

namespace kiln {

struct Pushed {
  enum Kind : uint8_t {
    kOpen,     // the site sees few back faces: it stays, and may stand for others
    kOutside,  // the site does not mostly see back faces: it stays
    kMoved,    // it is inside, and `place` is outside
    kBuried    // it is inside, and nothing outside is near enough
  } kind = kOutside;
  Vec3 place{0.0f};
};

// Where to sample instead of `site`. `texel_size` is a texel's side in metres. Depends on the scene and the
// arguments alone: all units that ask get the same answer. Adds the rays it traced to `rays`.
//
// The push of lightmappers (O'Donnell 2018 discards such texels; Godot's baker moves them): rays along the
// tangent plane look for back faces, which are the way out. A place behind the nearest one, an eighth of a
// texel off it or half way to what comes next, is taken if it does not mostly see back faces itself.
Pushed push_out(const Surfaces& surfaces, const Tracer& tracer, const SurfacePoint& site, float texel_size,
                uint64_t& rays);

}  // namespace kiln
