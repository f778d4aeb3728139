// What a plan should make somebody change before any ray is traced.
#pragma once

#include <string>
#include <vector>

#include "coordinator/bake/plan/plan.h"

namespace kiln {

// Of layout pack: an object that has more than half of the texels, with the density at which it has as many
// as all others together; a map too coarse to show anything, with a density that shows something.
std::vector<std::string> advise_layout(const Scene& scene, const Atlas& atlas, const AtlasSettings& settings,
                                       const std::vector<ObjectPlan>& objects);

// Does the bake fit `memory` bytes, coordinator and one worker together? Else an error that names a density
// or a size that does, and who has the texels.
Status check_memory(const Plan& plan, const Atlas& atlas, uint64_t memory);

// "'a' 70 %, 'b' 12 %, 'c' 3 %": who has the most texels.
std::string largest_objects(const std::vector<ObjectPlan>& objects);

// Of the scene's box, metres.
double widest_side(const Scene& scene);

// The least number of 1, 2 or 5 times a power of ten that is not below `value`; the largest not above.
double round_up(double value);
double round_down(double value);

}  // namespace kiln
