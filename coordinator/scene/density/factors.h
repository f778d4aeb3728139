// The parts of an object's factor.
#pragma once

#include "common/scene/scene.h"
#include "coordinator/scene/density/bounds.h"

namespace kiln {

// The box that applies to an instance whose triangles have these bounds; -1: none.
int box_of(const Scene& scene, const Instance& instance, const Bounds& bounds,
           const std::vector<ImportanceBox>& boxes);

// Factor from viewpoints, above 0 and at most 1. `distance`: metres of full density; `unseen`: factor outside
// every view.
double view_factor(const Bounds& bounds, const std::vector<Viewpoint>& cameras, double distance,
                   double unseen);

// Factor from size, above 0 and at most 1; `small`: smallest diagonal with full density, metres.
double size_factor(const Bounds& bounds, double small);

// Rounds to the power of 2^(-1/4), from 1 to 1/64, with the nearest exponent.
double to_step(double factor);

}  // namespace kiln
