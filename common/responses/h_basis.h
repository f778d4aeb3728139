// The H-basis: irradiance over the hemisphere of normals, six numbers a colour, in the surface's own frame.
#pragma once

#include "common/responses/basis.h"

namespace kiln {

// Habel & Wimmer 2010, Efficient Irradiance Normal Mapping. With m in the ReceiverFrame of the shading
// normal,
//   E(m)/pi = H0 + 3 (Hx x + Hy y + Hz (2 z - 1)) + 15/4 (H2xy 2 x y + Hxx_yy (x^2 - y^2)),
// and each number is the mean of E/pi times its function over the hemisphere, so that none is larger than H0.
// The orthonormal coefficients of the paper are these times constants and, for two of them, -1
// (docs/bases.md).
struct HBasis {
  static constexpr std::array<std::string_view, 6> functions{"H0", "Hx", "Hy", "Hz", "H2xy", "Hxx_yy"};
  static constexpr std::array<bool, 6> is_signed{false, true, true, true, true, true};
  static constexpr std::array<uint32_t, 6> degree{0, 1, 1, 1, 2, 2};
  static BasisInfo info();
  static void evaluate(const Vec3& d, const Vec3& n, float* f);
};

// The same form, fitted to the normals within 60 degrees, with E at the shading normal exact and no number
// larger than H0.
struct HBasisCap {
  static constexpr std::array<std::string_view, 6> functions = HBasis::functions;
  static constexpr std::array<bool, 6> is_signed = HBasis::is_signed;
  static constexpr std::array<uint32_t, 6> degree = HBasis::degree;
  static BasisInfo info();
  static void evaluate(const Vec3& d, const Vec3& n, float* f);
};

}  // namespace kiln
