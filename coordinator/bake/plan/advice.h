// Advice on what to change before any ray is traced.
#pragma once

#include <string>
#include <vector>

#include "coordinator/bake/plan/plan.h"

namespace kiln {

// For layout pack: reports an object with more than half of the texels, with the density at which it has as
// many as all others together, and a map too coarse to show anything, with a density that would.
std::vector<std::string> advise_layout(const Scene& scene, const Atlas& atlas, const AtlasSettings& settings,
                                       const std::vector<ObjectPlan>& objects);

// Checks that the bake fits `memory` bytes, coordinator and one worker together. The error names a density or
// a size that does, and the largest objects.
Status check_memory(const Plan& plan, const Atlas& atlas, uint64_t memory);

// "'a' 70 %, 'b' 12 %, 'c' 3 %": the objects with the most texels.
std::string largest_objects(const std::vector<ObjectPlan>& objects);

// Longest side of the scene's bounding box, metres.
double widest_side(const Scene& scene);

// Rounds up, or down, to 1, 2 or 5 times a power of ten.
double round_up(double value);
double round_down(double value);

}  // namespace kiln
