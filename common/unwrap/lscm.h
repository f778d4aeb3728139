// Least squares conformal maps. Levy, Petitjean, Ray, Maillot 2002, "Least Squares Conformal Maps for
// Automatic Texture Atlas Generation", section 3. The energy is written as Dirichlet energy less area
// (Desbrun, Meyer, Alliez 2002, "Intrinsic Parameterizations of Surface Meshes", section 4), which is the
// same quadratic form with a sparser matrix: u and v are coupled along the boundary only.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/math/vec.h"

namespace kiln {

// `vertices` are positions in space; faces index them and wind consistently across shared sides. Unused
// vertices stay at (0, 0). Two far vertices are pinned at their distance. Empty when the system is singular
// (a component has neither pin) or a result is not finite. Faces thinner than a thousandth of their longest
// side count as that thick, so that needles do not ruin the conditioning.
std::vector<DVec2> lscm(std::span<const DVec3> vertices, std::span<const std::array<uint32_t, 3>> faces);

// Half cotangents of the face's angles: weights of the sides opposite its corners. Needles are treated as
// above.
std::array<double, 3> half_cotangents(const DVec3& a, const DVec3& b, const DVec3& c);

}  // namespace kiln
