// The parts of an object's factor.
#pragma once

#include "common/scene/scene.h"
#include "coordinator/scene/density/bounds.h"

namespace kiln {

// Which box counts for an instance whose triangles have these bounds; -1: none.
int box_of(const Scene& scene, const Instance& instance, const Bounds& bounds,
           const std::vector<ImportanceBox>& boxes);

// Of viewpoints, above 0 and at most 1. `distance`: of full density, metres; `unseen`: factor outside of a
// view.
double view_factor(const Bounds& bounds, const std::vector<Viewpoint>& cameras, double distance,
                   double unseen);

// Of size, above 0 and at most 1; `small`: diagonal of full density, metres.
double size_factor(const Bounds& bounds, double small);

// The power of 2^(-1/4) from 1 to 1/64 that is nearest in its exponent.
double to_step(double factor);

}  // namespace kiln
