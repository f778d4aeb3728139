// Decides which of two exactly coincident surfaces a ray hits. An acceleration structure returns the triangle
// it tests last, which depends on its build and on the instruction set.
#pragma once

#include <memory>

#include "worker/surface/surfaces.h"

namespace kiln {

// Wraps `tracer` with a rule: among opaque triangles with the same three corners, in any instances, a ray
// hits the one that faces it, and among several the first by instance and triangle; the hit point is
// recomputed from that triangle. So a sheet of two opposite faces is visible from both sides. Without such
// triangles returns `tracer` itself. `surfaces` outlives it. Takes O(n) time and two bits for each of 8 n
// cells. Surfaces with alpha are excluded: each covers independently.
std::unique_ptr<Tracer> with_coincident_rule(std::unique_ptr<Tracer> tracer, const Surfaces& surfaces);

}  // namespace kiln
