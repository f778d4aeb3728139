#include "common/responses/irradiance_fit.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/math/trig_double.h"

namespace kiln {
namespace {

constexpr double kPiDouble = 3.14159265358979323846;
constexpr int kSteps = 1024;

// Integrals over normals m = (z, azimuth): of z^k over the cap and the sphere, weighted.
struct Moments {
  double z[5];                // of z^0 to z^4
  double ring(int k) const {  // of x^2 z^k
    return 0.5 * (z[k] - z[k + 2]);
  }
};

Moments moments(const FitDomain& domain) {
  Moments m;
  double power = domain.lowest;
  for (int k = 0; k < 5; ++k, power *= domain.lowest) {
    const double cap = 2 * kPiDouble * (1 - power) / (k + 1);
    const double sphere = k % 2 ? 0.0 : 4 * kPiDouble / (k + 1);
    m.z[k] = cap + domain.outside * (sphere - cap);
  }
  return m;
}

// Integrals of max(0, m.d) times 1, z, z^2, x, x z and 2 x^2 + z^2 - 1.
struct Projections {
  double one = 0, z = 0, z2 = 0, x = 0, xz = 0, xx = 0;
};

// Closed over the azimuth, by the midpoint rule over sqrt(1 - z), in which nothing is steep. The tangential
// ones are divided by s, s and s^2.
Projections over_cap(double c, double s, double lowest) {
  Projections sum;
  for (int i = 0; i < kSteps; ++i) {
    const double v = (i + 0.5) / kSteps, z = 1 - (1 - lowest) * v * v, radius = std::sqrt(1 - z * z);
    const double width = 2 * (1 - lowest) * v / kSteps;
    const double wave = s * radius, level = c * z;  // m.d = level + wave cos(azimuth)
    double mean = 0, first = 0, second = 0;         // integrals over the azimuth times 1, cos, cos 2
    if (level >= wave) {
      mean = 2 * kPiDouble * level;
      first = kPiDouble * wave;
    } else if (level > -wave) {
      const double cosine = -level / wave, sine = std::sqrt(1 - cosine * cosine);
      const double edge = kPiDouble / 2 - arctangent(cosine, sine);
      const double triple = sine * (4 * cosine * cosine - 1);  // sin(3 edge)
      mean = 2 * (wave * sine + level * edge);
      first = wave * (edge + sine * cosine) + 2 * level * sine;
      second = 2 * level * sine * cosine + wave * (triple / 3 + sine);
    }
    sum.one += width * mean;
    sum.z += width * z * mean;
    sum.z2 += width * z * z * mean;
    sum.x += width * radius * first / s;
    sum.xz += width * radius * z * first / s;
    sum.xx += width * radius * radius * second / (s * s);
  }
  return sum;
}

// Over the sphere, by Funk and Hecke: max(0, m.d) has the eigenvalues pi, 2 pi / 3 and pi / 4.
Projections over_sphere(double c) {
  Projections sum;
  sum.one = kPiDouble;
  sum.z = 2 * kPiDouble / 3 * c;
  sum.z2 = kPiDouble / 4 * (c * c - 1.0 / 3) + kPiDouble / 3;
  sum.x = 2 * kPiDouble / 3;
  sum.xz = kPiDouble / 4 * c;
  sum.xx = kPiDouble / 4;
  return sum;
}

Projections projections(const FitDomain& domain, double c, double s) {
  const Projections cap = over_cap(c, s, domain.lowest), sphere = over_sphere(c);
  const auto mix = [&](double inside, double all) { return inside + domain.outside * (all - inside); };
  return {mix(cap.one, sphere.one), mix(cap.z, sphere.z),   mix(cap.z2, sphere.z2),
          mix(cap.x, sphere.x),     mix(cap.xz, sphere.xz), mix(cap.xx, sphere.xx)};
}

struct Two {
  double first, second;
};
// Solves the symmetric [a b; b d] x = r; without the second unknown if it is not used.
Two solve(double a, double b, double d, double r0, double r1, bool is_second_used) {
  if (!is_second_used) return {r0 / a, 0};
  const double det = a * d - b * b;
  KILN_CHECK(det > 0);
  return {(r0 * d - r1 * b) / det, (r1 * a - r0 * b) / det};
}

// The part without azimuth, given E(n): in powers of z about 1, where the level drops out.
void solve_exact(const FitDomain& domain, const Moments& m, const Projections& p, double e,
                 QuadraticFit& fit) {
  const double g11 = m.z[2] - 2 * m.z[1] + m.z[0];
  const double g12 = m.z[3] - m.z[2] - m.z[1] + m.z[0];
  const double g22 = m.z[4] - 2 * m.z[2] + m.z[0];
  const double r1 = p.z - p.one - e * (m.z[1] - m.z[0]), r2 = p.z2 - p.one - e * (m.z[2] - m.z[0]);
  const Two b = solve(g11, g12, g22, r1, r2, domain.along2);
  fit.along = b.first, fit.along2 = b.second;
  fit.level = e - fit.along - fit.along2;
}

// The same without a condition, in powers of z about its mean.
void solve_free(const FitDomain& domain, const Moments& m, const Projections& p, QuadraticFit& fit) {
  const double z1 = m.z[1] / m.z[0], z2 = m.z[2] / m.z[0];
  const Two b = solve(m.z[2] - z1 * m.z[1], m.z[3] - z2 * m.z[1], m.z[4] - z2 * m.z[2], p.z - z1 * p.one,
                      p.z2 - z2 * p.one, domain.along2);
  fit.along = b.first, fit.along2 = b.second;
  fit.level = p.one / m.z[0] - fit.along * z1 - fit.along2 * z2;
}

// Entries are even in this, from 0 at c = -1 to 2 at 1: near the ends coefficients are smooth in the sine.
double place_of(double c) {
  return c < 0 ? std::sqrt(1 + c) : 2 - std::sqrt(1 - c);
}
double cosine_at(double place) {
  return place < 1 ? place * place - 1 : 1 - (2 - place) * (2 - place);
}

}  // namespace

FitTable::FitTable(const FitDomain& domain) : domain_(domain) {
  for (int i = 0; i <= kIntervals; ++i) table_[i] = irradiance_fit(domain, cosine_at(2.0 * i / kIntervals));
}

QuadraticFit irradiance_fit(const FitDomain& domain, double c) {
  KILN_CHECK(domain.lowest >= -1 && domain.lowest < 1 && domain.outside >= 0 && domain.outside <= 1);
  constexpr double kLimit = 1 - 1e-6;  // beyond, quotients by the sine are those here
  c = std::clamp(c, -kLimit, kLimit);
  const double s = std::sqrt(1 - c * c);
  const Moments m = moments(domain);
  const Projections p = projections(domain, c, s);
  QuadraticFit fit;
  domain.is_exact ? solve_exact(domain, m, p, std::max(0.0, c), fit) : solve_free(domain, m, p, fit);
  const Two t = solve(m.ring(0), m.ring(1), m.ring(2), p.x, p.xz, domain.across_z);
  fit.across = t.first, fit.across_z = t.second;
  // The square of r^2 cos(2 azimuth) is r^4 / 2 in the mean.
  fit.across2 = p.xx / (0.5 * (m.z[0] - 2 * m.z[2] + m.z[4]));
  return fit;
}

QuadraticFit FitTable::operator()(float c) const {
  const double x = place_of(std::clamp(double{c}, -1.0, 1.0)) * (0.5 * kIntervals);
  const int i = std::min(static_cast<int>(x), kIntervals - 1);
  const double u = x - i;
  const QuadraticFit &a = table_[i], &b = table_[i + 1];
  const auto mix = [&](double from, double to) { return from + u * (to - from); };
  QuadraticFit fit{mix(a.level, b.level),   mix(a.along, b.along),       mix(a.along2, b.along2),
                   mix(a.across, b.across), mix(a.across_z, b.across_z), mix(a.across2, b.across2)};
  if (domain_.is_exact) fit.level = std::max(0.0, double{c}) - fit.along - fit.along2;
  return fit;
}

}  // namespace kiln
