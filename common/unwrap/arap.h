// Flattening as rigid as possible. Liu, Zhang, Xu, Gotsman, Gortler 2008, "A Local/Global Approach to Mesh
// Parameterization", section 3: each face wants to be a turned copy of itself, all positions are solved for
// at once, in turns. Evens out what a projection or a conformal map stretches.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/math/vec.h"

namespace kiln {

// Moves `uv`, a layout of `vertices` without flipped faces and of about their scale, by `rounds` rounds.
// False, and `uv` is as it was: the system is singular or a result is not finite. Nothing is promised about
// flips and overlaps of the result.
bool make_rigid(std::span<const DVec3> vertices, std::span<const std::array<uint32_t, 3>> faces, int rounds,
                std::vector<DVec2>& uv);

}  // namespace kiln
