// Which of two surfaces on exactly the same place a ray meets. An acceleration structure returns whichever of
// its triangles it tests last, which depends on how it was built and for which instruction set.
#pragma once

#include <memory>

#include "worker/surface/surfaces.h"

namespace kiln {

// `tracer` with a rule: of opaque triangles with the same three corners, in the same or other instances, a
// ray meets the one that faces it, and of several such the first by instance and triangle; the point is
// computed anew from that triangle. A sheet made of two opposite faces is thereby seen from both sides.
// Without such triangles this is `tracer` itself. `surfaces` outlives it. Takes O(n) time and two bits for
// each of 8 n cells. Surfaces with alpha are left as they are: each of them covers by itself.
std::unique_ptr<Tracer> with_coincident_rule(std::unique_ptr<Tracer> tracer, const Surfaces& surfaces);

}  // namespace kiln
