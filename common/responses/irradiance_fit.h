// Least-squares fits of irradiance E(m) over normals m, for light of unit irradiance at normal incidence from
// one direction: what a basis of low degree accumulates for each sample.
#pragma once

#include <array>

namespace kiln {

// A quadratic about the surface's normal n, for light from a direction d with c = d.n. With x the tangential
// part of m along d - c n, z = m.n and s = |d - c n|:
//   E(m) ~ level + z along + z^2 along2 + x s (across + z across_z) + (2 x^2 + z^2 - 1) s^2 across2.
// Coefficients that a fit does not use are 0.
struct QuadraticFit {
  double level = 0, along = 0, along2 = 0, across = 0, across_z = 0, across2 = 0;
};

// Which normals count, and what the fit may use.
struct FitDomain {
  double lowest;   // of z: normals of the cap above it have weight 1
  double outside;  // weight of the other normals of the sphere
  bool is_exact;   // E(n) = max(0, c) is kept
  bool along2, across_z;
};

// By quadrature; coefficients are right to 1e-4.
QuadraticFit irradiance_fit(const FitDomain& domain, double c);

// The same from a table, for samples: each term within 1e-4 of irradiance_fit(); an exact fit keeps E(n) to
// rounding.
class FitTable {
 public:
  explicit FitTable(const FitDomain& domain);
  QuadraticFit operator()(float c) const;

 private:
  static constexpr int kIntervals = 1024;
  FitDomain domain_;
  std::array<QuadraticFit, kIntervals + 1> table_;
};

}  // namespace kiln
