#include "common/responses/sh_l1_fit.h"

#include <algorithm>

#include "common/responses/evaluate.h"
#include "common/responses/irradiance_fit.h"

namespace kiln {
namespace {

constexpr double kPiDouble = 3.14159265358979323846;

// Moments of a cap of 60 degrees about n: integrals of 1, m.n, (m.n)^2 and (m.t)^2, t any tangent.
constexpr double kMu0 = 0.5;
constexpr double kG0 = 2 * kPiDouble * (1 - kMu0), kG1 = kPiDouble * (1 - kMu0 * kMu0);
constexpr double kA = 2 * kPiDouble * (1 - kMu0 * kMu0 * kMu0) / 3;
constexpr double kB = kPiDouble * (2.0 / 3 - kMu0 + kMu0 * kMu0 * kMu0 / 3);
constexpr double kK = kA - 2 * kG1 + kG0;  // integral of (m.n - 1)^2

// Beyond this cosine the whole cap sees the light or none of it does.
constexpr double kWhole = 0.86602540378443864676;

constexpr int kIntervals = 512;

// Two numbers, as a table of all terms of a fit costs more time, and this is the basis of most bakes.
const std::array<CapFit, kIntervals + 1>& cap_table() {
  static const auto kTable = [] {
    constexpr FitDomain kCap{kMu0, 0, true, false, false};
    std::array<CapFit, kIntervals + 1> table;
    for (int i = 0; i <= kIntervals; ++i) {
      const QuadraticFit fit = irradiance_fit(kCap, kWhole * (2.0 * i / kIntervals - 1));
      table[i] = {static_cast<float>(fit.along), static_cast<float>(fit.across)};
    }
    return table;
  }();
  return kTable;
}

// Where most of the light is behind the normal, E is what is left of a and b.n: neither may be more than this
// many times E, or rounding and compression would show.
constexpr float kMostShown = 4;

// The point of t^2 + z^2 <= 4 (e - z)^2, (1 - kMostShown) e <= z <= e with the least kB (t - t0)^2 + kK (z -
// z0)^2, where t0 >= 0: for each z the best t is known, and what remains is convex in z.
struct CapPoint {
  double t, z;
};

double longest(double e, double z) {
  return std::sqrt(std::max(0.0, 4 * (e - z) * (e - z) - z * z));
}

CapPoint bound_fit(double e, double t0, double z0) {
  z0 = std::max(z0, (1 - kMostShown) * e);
  double high = std::min(z0, e * (2.0 / 3));
  if (z0 <= high && t0 <= longest(e, z0)) return {t0, z0};
  // At -t0 / sqrt(3) there is room for t0.
  double low = std::clamp(-t0 / 1.7320508075688772, (1 - kMostShown) * e, high);
  for (int i = 0; i < 60 && low < high; ++i) {
    const double z = 0.5 * (low + high), room = longest(e, z);
    const double pull = room > 0 ? kB * std::max(0.0, t0 - room) * (4 * e - 3 * z) / room : 1e300;
    (kK * (z - z0) + pull > 0 ? high : low) = z;
  }
  const double z = 0.5 * (low + high);
  return {std::min(t0, longest(e, z)), z};
}

void store(double l0, const DVec3& l1, float* f) {
  f[0] = static_cast<float>(l0);
  // A part in 2^22 keeps |L1| <= L0 after rounding.
  const double size = length(l1), scale = size > l0 * (1 - 0x1p-22) ? l0 * (1 - 0x1p-22) / size : 1;
  for (int axis = 0; axis < 3; ++axis) f[1 + axis] = static_cast<float>(l1[axis] * scale);
}

// Below this squares of floats vanish: what light there is has no direction.
constexpr float kMinLight = 1e-18f;

void store_without_direction(float e, float* f) {
  f[0] = e > 0 ? e * kInvPi : 0.0f;
  std::fill(f + 1, f + 4, 0.0f);
}

void finish_cap(float e, const Vec3& normal, float* f) {
  if (!(e > kMinLight)) return store_without_direction(e, f);
  const DVec3 n(normal), b = DVec3(Vec3(f[1], f[2], f[3])) * (2 * kPiDouble);
  const double z0 = dot(b, n);
  const DVec3 across = b - n * z0;
  const double t0 = length(across);
  const CapPoint p = bound_fit(e, t0, z0);
  const DVec3 fitted = n * p.z + across * (t0 > 0 ? p.t / t0 : 0);
  store((e - p.z) / kPiDouble, fitted / (2 * kPiDouble), f);
}

void finish_hazel(float e, const Vec3& n, float* f) {
  if (!(e > kMinLight)) return store_without_direction(e, f);
  Vec3 l1(f[1], f[2], f[3]);
  for (int i = 0; i < 8 && kMostShown * sh_l1_irradiance_nonlinear(f[0], l1, n) < e; ++i) l1 = l1 * 0.5f;
  const float shown = sh_l1_irradiance_nonlinear(f[0], l1, n);
  if (!(kMostShown * shown >= e)) return store_without_direction(e, f);
  const double scale = double{e} / shown;
  store(f[0] * scale, DVec3(l1) * scale, f);
}

float irradiance_hazel(const float* f, const Vec3&, const Vec3& m) {
  return sh_l1_irradiance_nonlinear(f[0], Vec3(f[1], f[2], f[3]), m);
}

}  // namespace

CapFit cap_fit(float c) {
  if (c >= static_cast<float>(kWhole)) return {c, 1};
  if (c <= static_cast<float>(-kWhole)) return {0, 0};
  const auto& table = cap_table();
  const float x = (c / static_cast<float>(kWhole) + 1) * (0.5f * kIntervals);
  const int i = std::clamp(static_cast<int>(x), 0, kIntervals - 1);
  const float u = x - static_cast<float>(i);
  return {table[i].along + u * (table[i + 1].along - table[i].along),
          table[i].across + u * (table[i + 1].across - table[i].across)};
}

BasisInfo ShL1Cap::info() {
  BasisInfo b = ShL1::info();
  b.fit = "cap";
  b.about = "RGB L1 spherical harmonics fitted to E within 60 degrees of the normal, world axes";
  b.convention = "E(n)/pi = L0 + 2 L1.n, exact at the shading normal; |L1| <= L0";
  b.is_bounded = false;
  b.finish = finish_cap;
  return b;
}

void ShL1Cap::evaluate(const Vec3& d, const Vec3& n, float* f) {
  const float c = dot(d, n);
  const CapFit fit = cap_fit(c);
  const Vec3 b = n * (fit.along - c * fit.across) + d * fit.across;
  f[0] = (std::max(0.0f, c) - fit.along) * kInvPi;
  for (int axis = 0; axis < 3; ++axis) f[1 + axis] = 0.5f * kInvPi * b[axis];
}

BasisInfo ShL1Hazel::info() {
  BasisInfo b = ShL1::info();
  b.fit = "cap";
  b.evaluator = "hazel";
  b.about = "RGB L1 spherical harmonics scaled to E by Hazel's evaluation, world axes";
  b.convention =
      "E(n)/pi = L0 (k + (1 - k)(p + 1) q^p), a = |L1|/L0, q = (1 + n.L1/|L1|)/2, p = 1 + 2a, "
      "k = (1 - a)/(1 + a); exact at the shading normal";
  b.irradiance = irradiance_hazel;
  b.finish = finish_hazel;
  return b;
}

}  // namespace kiln
