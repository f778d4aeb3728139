#include "common/responses/sh_l2.h"

#include "common/responses/bound.h"
#include "common/responses/irradiance_fit.h"

namespace kiln {
namespace {

constexpr FitDomain kCap{0.5, 0.02, true, true, true};

// Adds a (u v^T + v u^T) / 2, whose trace is taken away elsewhere, to the five numbers of M.
void add_product(float a, const Vec3& u, const Vec3& v, float* m) {
  const float trace = dot(u, v) / 3;
  m[0] += a * 0.5f * (u.x * v.y + u.y * v.x);
  m[1] += a * 0.5f * (u.y * v.z + u.z * v.y);
  m[2] += a * (u.z * v.z - trace);
  m[3] += a * 0.5f * (u.x * v.z + u.z * v.x);
  m[4] += a * (u.x * v.x - u.y * v.y);
}

float irradiance(const float* f, const Vec3&, const Vec3& m) {
  const float xx = 0.5f * (f[8] - f[6]), yy = -0.5f * (f[8] + f[6]);
  const float square = xx * m.x * m.x + yy * m.y * m.y + f[6] * m.z * m.z;
  const float mixed = f[4] * m.x * m.y + f[5] * m.y * m.z + f[7] * m.x * m.z;
  return kPi * (f[0] + 2.0f * (f[1] * m.x + f[2] * m.y + f[3] * m.z) + 1.875f * (square + 2.0f * mixed));
}

void finish(float e, const Vec3& n, float* f) {
  hold_exactly({e, n, irradiance, 9}, f);
}

}  // namespace

BasisInfo ShL2::info() {
  BasisInfo b{};
  b.name = "sh_l2";
  b.functions = functions;
  b.is_signed = is_signed;
  b.degree = degree;
  b.has_direction = true;
  b.about = "RGB L2 spherical harmonics of radiance, world axes";
  b.convention =
      "L0 = 1/(4 pi) integral L dw, L1 = 1/(4 pi) integral L d dw, M = 1/(4 pi) integral L (d d^T - 1/3) dw "
      "of which L2ab = M_ab and L2xx_yy = M_xx - M_yy; E(n)/pi = L0 + 2 L1.n + 15/8 n^T M n";
  b.fit = "project";
  b.evaluator = "linear";
  b.irradiance = irradiance;
  return b;
}

void ShL2::evaluate(const Vec3& d, const Vec3&, float* f) {
  constexpr float k = 0.25f * kInvPi;
  f[0] = k;
  for (int axis = 0; axis < 3; ++axis) f[1 + axis] = k * d[axis];
  std::fill(f + 4, f + 9, 0.0f);
  add_product(k, d, d, f + 4);
}

BasisInfo ShL2Cap::info() {
  BasisInfo b = ShL2::info();
  b.fit = "cap";
  b.about = "RGB L2 spherical harmonics fitted to E within 60 degrees of the normal, world axes";
  b.convention =
      "M symmetric, M_xx + M_yy + M_zz = 0, L2ab = M_ab, L2xx_yy = M_xx - M_yy; E(n)/pi = L0 + 2 L1.n + "
      "15/8 n^T M n, exact at the shading normal";
  b.is_bounded = false;
  b.finish = finish;
  return b;
}

void ShL2Cap::evaluate(const Vec3& d, const Vec3& n, float* f) {
  static const FitTable kFit(kCap);
  const float c = dot(d, n);
  const QuadraticFit q = kFit(c);
  const Vec3 t = d - n * c;
  // E = level + along2/3 + b.m + m^T Q m, Q traceless: 2 x^2 + z^2 - 1 is m^T (2 x x^T + n n^T - 1) m.
  const auto along = static_cast<float>(q.along), across = static_cast<float>(q.across);
  f[0] = static_cast<float>(q.level + q.along2 / 3) * kInvPi;
  for (int axis = 0; axis < 3; ++axis) f[1 + axis] = 0.5f * kInvPi * (along * n[axis] + across * t[axis]);
  constexpr float k = kInvPi / 1.875f;
  const float square = 1.0f - c * c;
  std::fill(f + 4, f + 9, 0.0f);
  add_product(k * static_cast<float>(q.along2 + q.across2 * square), n, n, f + 4);
  add_product(k * static_cast<float>(q.across_z), n, t, f + 4);
  add_product(k * 2 * static_cast<float>(q.across2), t, t, f + 4);
}

}  // namespace kiln
