// Flattening as rigid as possible. Liu, Zhang, Xu, Gotsman, Gortler 2008, "A Local/Global Approach to Mesh
// Parameterization", section 3: alternates between the best rotation of each face and a global solve for all
// positions. Evens out the stretch of a projection or a conformal map.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/math/vec.h"

namespace kiln {

// Moves `uv`, a layout of `vertices` without flipped faces and of about their scale, by `rounds` rounds.
// Returns false and leaves `uv` unchanged if the system is singular or a result is not finite. The result may
// have flips and overlaps.
bool make_rigid(std::span<const DVec3> vertices, std::span<const std::array<uint32_t, 3>> faces, int rounds,
                std::vector<DVec2>& uv);

}  // namespace kiln
