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

// Positions of `vertices` in space; faces index them, and wind alike across shared sides. Vertices that no
// face has stay at (0, 0). Two far vertices are pinned at their distance. Empty when the system is singular
// (a part hangs on neither pin) or a result is not finite. Faces lower than a thousandth of their longest
// side are taken to be that high, so that needles do not spoil the conditioning.
std::vector<DVec2> lscm(std::span<const DVec3> vertices, std::span<const std::array<uint32_t, 3>> faces);

// Cotangents of the face's angles, halved: weights of the sides opposite to its corners. As above for
// needles.
std::array<double, 3> half_cotangents(const DVec3& a, const DVec3& b, const DVec3& c);

}  // namespace kiln
