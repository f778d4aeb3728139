#include "tests/bench/basis_skies.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "common/responses/evaluate.h"
#include "common/responses/lobes_specular.h"
#include "common/responses/receiver_frame.h"
#include "tests/common/ggx_reference.h"
#include "tests/common/random_light.h"

namespace kiln::test {
namespace {

constexpr double kAlphas[] = {0.4, 0.1};
constexpr int kBands = 5;  // SH up to degree 4
const Vec3 kUp(0, 0, 1);

// Spherical spiral of even density; low: the least z.
Vec3 spiral(int i, int count, double low) {
  return on_cap((i + 0.5) / count, std::fmod(0.61803398874989485 * i, 1.0), low);
}

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// 1 within `degrees` of `axis`; the edge is a tenth of it.
float disc(const Vec3& d, const Vec3& axis, float degrees) {
  const float edge = std::cos(degrees * 1.05f * kPi / 180), core = std::cos(degrees * 0.95f * kPi / 180);
  return smooth_step(edge, core, dot(d, axis));
}

Vec3 at(float azimuth, float elevation) {  // degrees
  const float a = azimuth * kPi / 180, e = elevation * kPi / 180;
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

// The overcast sky of the CIE over a ground of reflectance 0.2.
float overcast(const Vec3& d) {
  return d.z > 0 ? (1 + 2 * d.z) / 3 : 0.2f * 7 / 9;
}

// Blue sky, brighter at the horizon and about the sun, whose disc of 5 degrees gives five times its light.
float noon(const Vec3& d) {
  const Vec3 sun = at(30, 60);
  if (d.z < 0) return 0.8f;
  const float haze = 1 - d.z, near = dot(d, sun);
  return 0.5f + 0.7f * haze * haze * haze + 2.0f * std::exp(20 * (near - 1)) + 2500.0f * disc(d, sun, 2.5f);
}

// A red band about the sun, which stands 6 degrees high; the far side is dark.
float sunset(const Vec3& d) {
  const Vec3 sun = at(110, 6);
  if (d.z < 0) return 0.08f;
  const float near = std::max(0.0f, dot(d, sun));
  return 0.08f + (0.25f + 2.0f * near * near * near) * std::exp(-5 * d.z) + 300.0f * disc(d, sun, 2.5f);
}

// Six lamps of 6 to 12 degrees in a dark room.
float studio(const Vec3& d) {
  return 0.02f + 60 * disc(d, at(20, 70), 6) + 40 * disc(d, at(100, 35), 4) + 25 * disc(d, at(190, 50), 5) +
         80 * disc(d, at(255, 20), 3) + 30 * disc(d, at(310, 40), 4) + 20 * disc(d, at(60, 12), 6);
}

// Facades on both sides with lit windows, a strip of sky between them, pavement below.
float street(const Vec3& d) {
  const float away = std::max(std::abs(d.x), 1e-4f), along = d.y / away, high = d.z / away;
  if (high < -0.3f) return 0.15f;
  if (high > 2.0f) return 2.0f + 1.5f * d.y;
  const float cell_y = std::floor(along / 0.5f), cell_z = std::floor(high / 0.6f);
  const float y = along / 0.5f - cell_y, z = high / 0.6f - cell_z;
  if (y < 0.3f || y > 0.8f || z < 0.25f || z > 0.85f) return d.x > 0 ? 0.35f : 0.12f;
  const auto seed = static_cast<int>(cell_y * 7 + cell_z * 13 + (d.x > 0 ? 5 : 0));
  return (seed % 4 + 4) % 4 == 0 ? 8.0f : 0.06f;
}

constexpr Sky kSkies[] = {
    {"overcast", overcast}, {"noon", noon}, {"sunset", sunset}, {"studio", studio}, {"street", street}};

struct Ray {
  Vec3 direction;
  float radiance;
};
// The mean radiance of the upper hemisphere is 1.
std::vector<Ray> rays_of(const Sky& sky, int count) {
  std::vector<Ray> rays;
  double sum = 0, upper = 0;
  for (int i = 0; i < count; ++i) {
    rays.push_back({spiral(i, count, -1), 0});
    rays.back().radiance = sky.radiance(rays.back().direction);
    if (rays.back().direction.z > 0) sum += rays.back().radiance, ++upper;
  }
  for (Ray& r : rays) r.radiance /= static_cast<float>(sum / upper);
  return rays;
}

// GGX about the mirror direction with normal = eye: weights of light at cosine c, sum 1.
struct Kernel {
  struct Ring {
    double cosine, weight;
  };
  std::vector<Ring> rings;
  double a2;
  explicit Kernel(double alpha) : a2(alpha * alpha) {
    constexpr int kRings = 300;
    double sum = 0;
    for (int i = 0; i < kRings; ++i) {
      // D(h) (n.h) dh is even over u, dl = 4 (n.h) dh, and light counts by its cosine.
      const double u = (i + 0.5) / kRings, c = 2 * (1 - u) / (1 + (a2 - 1) * u) - 1;
      if (c > 0) rings.push_back({c, c}), sum += c;
    }
    for (Ring& r : rings) r.weight /= sum;
  }
  double operator()(double c) const {  // of no unit
    if (c <= 0) return 0;
    const double d = (1 + c) / 2 * (a2 - 1) + 1;
    return c / (d * d);
  }
};
const Kernel& kernel(size_t which) {
  static const Kernel kKernels[] = {Kernel(kAlphas[0]), Kernel(kAlphas[1])};
  return kKernels[which];
}

void legendre(double c, double* p) {
  p[0] = 1, p[1] = c;
  for (int l = 2; l < kBands; ++l) p[l] = ((2 * l - 1) * c * p[l - 1] - (l - 1) * p[l - 2]) / l;
}

// A lobe seen through a kernel, by the cosine of the normal to its axis.
class SoftLobe {
 public:
  SoftLobe(const LobeSet& set, const Kernel& kernel) {
    for (int i = 0; i <= kSteps; ++i) {
      const double c = 2.0 * i / kSteps - 1, s = std::sqrt(std::max(0.0, 1 - c * c));
      double sum = 0;
      for (const Kernel::Ring& r : kernel.rings)
        for (int k = 0; k < kTurns; ++k) {
          const double side = s * std::sqrt(1 - r.cosine * r.cosine) * std::cos(M_PI * (k + 0.5) / kTurns);
          sum += r.weight * double{lobe_radiance(set, static_cast<float>(c * r.cosine + side))};
        }
      table_.push_back(sum / kTurns);
    }
  }
  double operator()(double c) const {
    const double x = std::clamp((c + 1) / 2, 0.0, 1.0) * kSteps;
    const int k = std::min(static_cast<int>(x), kSteps - 1);
    return table_[k] + (x - k) * (table_[k + 1] - table_[k]);
  }

 private:
  static constexpr int kSteps = 400, kTurns = 24;
  std::vector<double> table_;
};

// What a normal sees of the sky, and what SH up to each degree say about it; [2] and [3]: through the
// kernels.
struct Seen {
  double radiance = 0, lambert = 0, soft[2] = {};
  double band[kBands] = {};  // light's own part of a degree
};
Seen look(const std::vector<Ray>& rays, const Sky& sky, double scale, const Vec3& n) {
  Seen seen;
  double total[2] = {};
  for (const Ray& r : rays) {
    const auto c = double{dot(r.direction, n)};
    double p[kBands];
    legendre(c, p);
    for (int l = 0; l < kBands; ++l) seen.band[l] += p[l] * double{r.radiance};
    if (c <= 0) continue;
    seen.lambert += c * double{r.radiance};
    for (size_t k = 0; k < 2; ++k) {
      const double w = kernel(k)(c);
      seen.soft[k] += w * double{r.radiance}, total[k] += w;
    }
  }
  const double each = 1 / static_cast<double>(rays.size());
  for (int l = 0; l < kBands; ++l) seen.band[l] *= (2 * l + 1) * each;
  seen.lambert *= 4 * each;
  for (size_t k = 0; k < 2; ++k) seen.soft[k] /= total[k];
  seen.radiance = double{sky.radiance(n)} * scale;
  return seen;
}

struct Squares {
  double sum = 0, count = 0;
  void add(double difference) { sum += difference * difference, ++count; }
  double rms() const { return std::sqrt(sum / count); }
};

// What a basis stores of light at a surface of normal z, one colour.
std::vector<float> stored(uint32_t basis, const std::vector<Ray>& rays, bool upper) {
  const size_t count = basis_roster()[basis].functions.size();
  std::vector<double> sums(count);
  float f[kMaxBasisFunctions];
  for (const Ray& r : rays) {
    if (upper && r.direction.z <= 0) continue;
    evaluate_basis(basis, r.direction, kUp, f);
    for (size_t i = 0; i < count; ++i) sums[i] += double{r.radiance} * double{f[i]};
  }
  std::vector<float> out;
  for (const double s : sums)
    out.push_back(static_cast<float>(s * 4 * M_PI / static_cast<double>(rays.size())));
  return out;
}

struct NamedLobes {
  const char* name;
  const LobeSet& (*set)();
};
constexpr NamedLobes kLobes[] = {
    {"ad9", ad9_lobes}, {"ad12", ad12_lobes}, {"sg9", sg9_lobes}, {"sg12", sg12_lobes}};

// Light through a filter of SH bands whose kernel has the means `mean` of Legendre's polynomials.
double through(const Seen& seen, int degree, const double* mean) {
  double sum = 0;
  for (int l = 0; l <= degree; ++l) sum += mean[l] * seen.band[l];
  return sum;
}

struct Harmonics {
  double sharp[kBands], lambert[kBands] = {1, 2.0 / 3, 0.25, 0, -1.0 / 24}, soft[2][kBands] = {};
  Harmonics() {
    std::fill(sharp, sharp + kBands, 1.0);
    for (size_t k = 0; k < 2; ++k)
      for (const Kernel::Ring& r : kernel(k).rings) {
        double p[kBands];
        legendre(r.cosine, p);
        for (int l = 0; l < kBands; ++l) soft[k][l] += r.weight * p[l];
      }
  }
};

SkyErrors harmonics_errors(const char* name, int degree, const std::vector<Seen>& seen,
                           const std::vector<float>& f, std::span<const Vec3> normals) {
  static const Harmonics kMeans;
  Squares radiance, lambert, soft[2];
  const bool is_stored = !f.empty();
  for (size_t i = 0; i < normals.size(); ++i) {
    radiance.add(through(seen[i], degree, kMeans.sharp) - seen[i].radiance);
    const double shown = is_stored
                             ? basis_roster()[*find_basis(name)].irradiance(f.data(), kUp, normals[i]) / M_PI
                             : through(seen[i], degree, kMeans.lambert);
    lambert.add(shown - seen[i].lambert);
    for (size_t k = 0; k < 2; ++k) soft[k].add(through(seen[i], degree, kMeans.soft[k]) - seen[i].soft[k]);
  }
  const auto numbers = static_cast<size_t>(3 * (degree + 1) * (degree + 1));
  return {name, numbers, radiance.rms(), lambert.rms(), soft[0].rms(), soft[1].rms()};
}

SkyErrors lobes_errors(const NamedLobes& lobes, const std::vector<Seen>& seen, const std::vector<Ray>& rays,
                       std::span<const Vec3> normals) {
  const LobeSet& set = lobes.set();
  const std::vector<float> f = stored(*find_basis(lobes.name), rays, false);
  const SoftLobe soft_lobe[] = {SoftLobe(set, kernel(0)), SoftLobe(set, kernel(1))};
  Squares radiance, lambert, soft[2];
  const ReceiverFrame frame(kUp);
  for (size_t i = 0; i < normals.size(); ++i) {
    const Vec3 n = set.is_local ? frame.to_local(normals[i]) : normals[i];
    double sharp = 0, softened[2] = {};
    for (size_t k = 0; k < set.count; ++k) {
      const float c = dot(n, set.axis[k]);
      sharp += double{f[k]} * double{lobe_radiance(set, c)};
      for (size_t a = 0; a < 2; ++a) softened[a] += double{f[k]} * soft_lobe[a](double{c});
    }
    radiance.add(sharp - seen[i].radiance);
    lambert.add(double{lobes_irradiance(set, f.data(), kUp, normals[i])} / M_PI - seen[i].lambert);
    for (size_t a = 0; a < 2; ++a) soft[a].add(softened[a] - seen[i].soft[a]);
  }
  return {lobes.name, 3 * set.count, radiance.rms(), lambert.rms(), soft[0].rms(), soft[1].rms()};
}

// Radiance of the sky's upper half that a white surface of GGX reflects to `eye`.
double reflected(const std::vector<Ray>& rays, const Vec3& eye, double alpha) {
  const double a2 = alpha * alpha, nv = double{eye.z}, eye_lambda = smith_lambda(nv, alpha);
  double sum = 0;
  for (const Ray& r : rays) {
    const auto nl = double{r.direction.z};
    if (nl <= 0) continue;
    const Vec3 half = r.direction + eye;
    const double nh2 = double{half.z} * double{half.z} / double{dot(half, half)};
    const double d = nh2 * (a2 - 1) + 1;
    sum += double{r.radiance} / (d * d * (1 + eye_lambda + smith_lambda(nl, alpha)));
  }
  return sum * a2 / nv / static_cast<double>(rays.size());  // of a2 / pi, 1 / (4 nv) and 4 pi / count
}

}  // namespace

std::span<const Sky> skies() {
  return kSkies;
}

std::vector<SkyErrors> sky_errors(const Sky& sky, int directions, int count) {
  const std::vector<Ray> rays = rays_of(sky, directions);
  const double scale = double{rays[0].radiance} / double{sky.radiance(rays[0].direction)};
  std::vector<Vec3> normals;
  std::vector<Seen> seen;
  for (int i = 0; i < count; ++i) {
    normals.push_back(spiral(i, count, 0));
    seen.push_back(look(rays, sky, scale, normals.back()));
  }
  std::vector<SkyErrors> out;
  out.push_back(harmonics_errors("sh_l1", 1, seen, stored(*find_basis("sh_l1"), rays, false), normals));
  out.push_back(harmonics_errors("sh_l2", 2, seen, stored(*find_basis("sh_l2"), rays, false), normals));
  out.push_back(harmonics_errors("sh_l4", 4, seen, {}, normals));
  const uint32_t h = *find_basis("h6");
  const std::vector<float> f = stored(h, rays, false);
  Squares lambert;
  for (int i = 0; i < count; ++i)
    lambert.add(basis_roster()[h].irradiance(f.data(), kUp, normals[i]) / M_PI - seen[i].lambert);
  SkyErrors h_basis{"h6", 3 * f.size()};
  h_basis.lambert = lambert.rms();
  out.push_back(h_basis);
  for (const NamedLobes& lobes : kLobes) out.push_back(lobes_errors(lobes, seen, rays, normals));
  return out;
}

bool keeps_order(const Sky& sky, std::span<const SkyErrors> errors) {
  const auto of = [&](std::string_view basis) {
    return *std::find_if(errors.begin(), errors.end(), [&](const SkyErrors& e) { return e.basis == basis; });
  };
  const SkyErrors dice = of("ad9"), gaussians = of("sg9"), all_dice = of("ad12"), l2 = of("sh_l2");
  bool kept = true;
  const auto claim = [&](bool holds, const char* what) {
    if (!holds) std::printf("%s: %s does not hold\n", sky.name, what);
    kept &= holds;
  };
  claim(dice.lambert < gaussians.lambert, "AD9 nearer to Lambert than SG9");
  const bool is_street = std::string_view(sky.name) == "street";
  claim(is_street || dice.rough < gaussians.rough, "AD9 nearer to GGX of alpha 0.4 than SG9");
  claim(all_dice.lambert < 1.125 * l2.lambert, "AD12 as near to Lambert as SH L2");
  return kept;
}

std::vector<ReflectionErrors> reflection_errors(const Sky& sky, int directions, int views) {
  const std::vector<Ray> rays = rays_of(sky, directions);
  LobeTexel texels[std::size(kLobes)];
  for (size_t k = 0; k < std::size(kLobes); ++k) {
    const std::vector<float> f = stored(*find_basis(kLobes[k].name), rays, true);
    for (size_t i = 0; i < f.size(); ++i) texels[k].lobe[i] = Vec3(f[i]);
  }
  const std::vector<float> l1 = stored(*find_basis("sh_l1"), rays, true);
  const ShL1Texel lamp{Vec3(l1[0]), {Vec3(l1[1]), Vec3(l1[2]), Vec3(l1[3])}};
  Squares squares[std::size(kLobes) + 1][2];
  for (size_t a = 0; a < 2; ++a)
    for (int v = 0; v < views; ++v) {
      const Vec3 eye = spiral(v, views, 0);
      const double truth = reflected(rays, eye, kAlphas[a]);
      const auto roughness = static_cast<float>(std::sqrt(kAlphas[a]));
      for (size_t k = 0; k < std::size(kLobes); ++k) {
        const Vec3 shown = lobes_specular(kLobes[k].set(), texels[k], kUp, kUp, eye, roughness, Vec3(1.0f));
        squares[k][a].add(double{shown.x} - truth);
      }
      const Vec3 shown = specular_from_l1(lamp, kUp, eye, roughness, Vec3(1.0f));
      squares[std::size(kLobes)][a].add(double{shown.x} - truth);
    }
  std::vector<ReflectionErrors> out;
  for (size_t k = 0; k <= std::size(kLobes); ++k)
    out.push_back(
        {k < std::size(kLobes) ? kLobes[k].name : "sh_l1, lamp", squares[k][0].rms(), squares[k][1].rms()});
  return out;
}

}  // namespace kiln::test
