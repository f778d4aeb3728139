#include "common/responses/h_basis.h"

#include "common/responses/bound.h"
#include "common/responses/irradiance_fit.h"
#include "common/responses/receiver_frame.h"

namespace kiln {
namespace {

constexpr FitDomain kHemisphere{0, 0, false, false, false}, kCap{0.5, 0.02, true, false, false};

float irradiance(const float* f, const Vec3& n, const Vec3& m) {
  const Vec3 v = ReceiverFrame(n).to_local(m);
  const float first = f[1] * v.x + f[2] * v.y + f[3] * (2.0f * v.z - 1.0f);
  const float second = f[4] * 2.0f * v.x * v.y + f[5] * (v.x * v.x - v.y * v.y);
  return kPi * (f[0] + 3.0f * first + 3.75f * second);
}

void store(const FitTable& fit, const Vec3& d, const Vec3& n, float* f) {
  const Vec3 v = ReceiverFrame(n).to_local(d);
  const QuadraticFit q = fit(v.z);
  const auto across = static_cast<float>(q.across) * (kInvPi / 3), half = static_cast<float>(0.5 * q.along);
  const auto across2 = static_cast<float>(q.across2) * (kInvPi / 3.75f);
  f[0] = (static_cast<float>(q.level) + half) * kInvPi;
  f[1] = across * v.x;
  f[2] = across * v.y;
  f[3] = half * (kInvPi / 3);
  f[4] = across2 * 2 * v.x * v.y;
  f[5] = across2 * (v.x * v.x - v.y * v.y);
}

void finish(float e, const Vec3& n, float* f) {
  hold_exactly({e, n, irradiance, 6}, f);
}

}  // namespace

BasisInfo HBasis::info() {
  BasisInfo b{};
  b.name = "h6";
  b.functions = functions;
  b.is_signed = is_signed;
  b.degree = degree;
  b.band = "H";
  b.is_local = true;
  b.about = "RGB H-basis of irradiance over the hemisphere, frame of the normal";
  b.convention =
      "x, y, z of n in the surface's frame: E(n)/pi = H0 + 3 (Hx x + Hy y + Hz (2 z - 1)) + 15/4 (2 H2xy x y "
      "+ "
      "Hxx_yy (x^2 - y^2))";
  b.fit = "project";
  b.evaluator = "linear";
  b.irradiance = irradiance;
  return b;
}

void HBasis::evaluate(const Vec3& d, const Vec3& n, float* f) {
  static const FitTable kFit(kHemisphere);
  store(kFit, d, n, f);
}

BasisInfo HBasisCap::info() {
  BasisInfo b = HBasis::info();
  b.fit = "cap";
  b.about = "RGB H-basis fitted to E within 60 degrees of the normal, frame of the normal";
  b.is_bounded = false;
  b.finish = finish;
  return b;
}

void HBasisCap::evaluate(const Vec3& d, const Vec3& n, float* f) {
  static const FitTable kFit(kCap);
  store(kFit, d, n, f);
}

}  // namespace kiln
