// RGB L1 spherical harmonics whose evaluation at the surface's own normal is E itself.
//
// A projection of light on L1 (ShL1) is the best such function over the whole sphere of normals, of which a
// surface uses a cap: linear evaluation of a lamp straight above gives 3/4 of its light. The numbers stored
// are the same four a colour; here they are chosen for the normals that a surface shows (Sloan & Silvennoinen
// 2018, Directional Lightmap Encoding Insights, on the shortfall; the fit is ours).
#pragma once

#include "common/responses/basis.h"

namespace kiln {

// Least squares over the normals m within 60 degrees of the shading normal n:
//   minimise  integral over the cap of (a + b.m - E(m))^2 dm,  a + b.n = E(n),  a = pi L0, b = 2 pi L1.
// Without |L1| <= L0 the solution is linear in the light, so samples accumulate their part of it
// (docs/bases.md); finish() imposes the bound and keeps a + b.n = E(n).
struct ShL1Cap {
  static constexpr std::array<std::string_view, 4> functions = ShL1::functions;
  static constexpr std::array<bool, 4> is_signed = ShL1::is_signed;
  static constexpr std::array<uint32_t, 4> degree = ShL1::degree;
  static BasisInfo info();
  static void evaluate(const Vec3& d, const Vec3& n, float* f);
};

// The projection, scaled so that the non-linear evaluation (Hazel 2017) at n is E(n).
struct ShL1Hazel {
  static constexpr std::array<std::string_view, 4> functions = ShL1::functions;
  static constexpr std::array<bool, 4> is_signed = ShL1::is_signed;
  static constexpr std::array<uint32_t, 4> degree = ShL1::degree;
  static BasisInfo info();
  static void evaluate(const Vec3& d, const Vec3& n, float* f) { ShL1::evaluate(d, n, f); }
};

// For light of unit irradiance at normal incidence from a direction of cosine c to n: the fit's b = along n +
// across (d - c n), before the bound. Absolute error below 5e-5.
struct CapFit {
  float along, across;
};
CapFit cap_fit(float c);

}  // namespace kiln
