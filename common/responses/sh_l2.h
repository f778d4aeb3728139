// RGB spherical harmonics up to degree 2: nine numbers a colour, world axes.
#pragma once

#include "common/responses/basis.h"

namespace kiln {

// L0 and L1 as in ShL1, and the traceless matrix M = 1/(4 pi) int L (d d^T - 1/3) dw, five numbers of which
// are stored: xy, yz, zz, xz and xx - yy. E(m)/pi = L0 + 2 L1.m + 15/8 m^T M m (Ramamoorthi & Hanrahan 2001,
// An Efficient Representation for Irradiance Environment Maps; the coefficients of orthonormal harmonics are
// these times constants, docs/bases.md).
struct ShL2 {
  static constexpr std::array<std::string_view, 9> functions{"L0",   "L1x",  "L1y",  "L1z",    "L2xy",
                                                             "L2yz", "L2zz", "L2xz", "L2xx_yy"};
  static constexpr std::array<bool, 9> is_signed{false, true, true, true, true, true, true, true, true};
  static constexpr std::array<uint32_t, 9> degree{0, 1, 1, 1, 2, 2, 2, 2, 2};
  static BasisInfo info();
  static void evaluate(const Vec3& d, const Vec3& n, float* f);
};

// The same numbers, fitted to E over the normals within 60 degrees of the shading normal n, with E(n) exact;
// |L1| and each number of M are at most L0. The other normals count 1/50, which keeps the numbers bounded.
struct ShL2Cap {
  static constexpr std::array<std::string_view, 9> functions = ShL2::functions;
  static constexpr std::array<bool, 9> is_signed = ShL2::is_signed;
  static constexpr std::array<uint32_t, 9> degree = ShL2::degree;
  static BasisInfo info();
  static void evaluate(const Vec3& d, const Vec3& n, float* f);
};

}  // namespace kiln
