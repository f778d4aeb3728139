#include "common/responses/lobes.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/math/trig.h"
#include "common/math/trig_double.h"
#include "common/responses/receiver_frame.h"

namespace kiln {
namespace {

constexpr double kPiDouble = 3.14159265358979323846;

double radiance(bool is_dice, double c) {
  if (is_dice) return c > 0 ? c * c * (0.35 + 0.25 * c * c) : 0.0;
  return double{exponential(kGaussianSharpness * static_cast<float>(c - 1))};
}

// Hill's fit of a Gaussian's irradiance (2016), here for the one sharpness; e^-6 and constants folded.
double gaussian_irradiance(double c) {
  constexpr double kLambda = kGaussianSharpness, kC0 = 0.36, kC1 = 1 / (4 * kC0);
  static const double kE = double{exponential(-kGaussianSharpness)}, kE2 = kE * kE;
  static const double kScale = 1 + 2 * kE2 - 1 / kLambda, kBias = (kE - kE2) / kLambda - kE2;
  static const double kX = std::sqrt(1 - kScale);
  const double x0 = kC0 * c, x1 = kC1 * kX, sum = x0 + x1;
  const double y = std::abs(x0) <= x1 ? sum * sum / kX : std::clamp(c, 0.0, 1.0);
  return (kScale * y + kBias) * (2 / kLambda);
}

// int B_i B_j over the sphere, by the midpoint rule about axis i: a function of the angle between the axes
// alone.
double pair_integral(bool is_dice, double cosine) {
  constexpr int kHeights = 400, kAngles = 200;
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  double sum = 0;
  for (int a = 0; a < kAngles; ++a) {
    const double side = sine * sincos_radians(kPiDouble * (a + 0.5) / kAngles).cos;
    for (int h = 0; h < kHeights; ++h) {
      const double z = (h + 0.5) * 2 / kHeights - 1;
      sum += radiance(is_dice, z) * radiance(is_dice, cosine * z + side * std::sqrt(1 - z * z));
    }
  }
  return sum * 4 * kPiDouble / (double{kHeights} * kAngles);
}

// Lobes that may be other than 0.
struct Used {
  size_t count = 0, at[kMaxLobes];
};

// Solves A x = b, A symmetric positive definite, over those lobes.
void solve(const double (&a)[kMaxLobes][kMaxLobes], const double* b, const Used& used, double* x) {
  const size_t n = used.count;
  double l[kMaxLobes][kMaxLobes], y[kMaxLobes];
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j <= i; ++j) {
      double sum = a[used.at[i]][used.at[j]];
      for (size_t k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
      if (i == j) KILN_CHECK(sum > 0);  // lobes with different axes are independent
      l[i][j] = i == j ? std::sqrt(sum) : sum / l[j][j];
    }
  for (size_t i = 0; i < n; ++i) {
    y[i] = b[used.at[i]];
    for (size_t k = 0; k < i; ++k) y[i] -= l[i][k] * y[k];
    y[i] /= l[i][i];
  }
  for (size_t i = n; i-- > 0;) {
    for (size_t k = i + 1; k < n; ++k) y[i] -= l[k][i] * y[k];
    y[i] /= l[i][i];
  }
  for (size_t i = 0; i < n; ++i) x[used.at[i]] = y[i];
}

// gram + 100 int I_i I_j dm, over the normals within 60 degrees of a local basis' own, else over all. Lobes
// that may not be negative then miss irradiance by a fifth less (ad9, 35 to 60 degrees off the normal: 12.7
// instead of 16.1 %, docs/bases.md).
void set_metric(LobeSet& set) {
  constexpr double kIrradiance = 100;
  constexpr int kNormals = 4000;
  const double low = set.is_local ? 0.5 : -1.0, each = 2 * kPiDouble * (1 - low) / kNormals;
  double shown[kMaxLobes];
  for (size_t i = 0; i < set.count; ++i) std::copy(set.gram[i], set.gram[i] + set.count, set.metric[i]);
  for (int k = 0; k < kNormals; ++k) {
    const double z = 1 - (1 - low) * (k + 0.5) / kNormals, turns = 0.61803398875 * k;
    const SinCosDouble a = sincos_radians(2 * kPiDouble * (turns - std::floor(turns)));
    const DVec3 m(std::sqrt(1 - z * z) * DVec3(a.cos, a.sin, 0) + DVec3(0, 0, z));
    for (size_t i = 0; i < set.count; ++i)
      shown[i] = lobe_irradiance(set, static_cast<float>(dot(m, DVec3(set.axis[i]))));
    for (size_t i = 0; i < set.count; ++i)
      for (size_t j = 0; j < set.count; ++j) set.metric[i][j] += kIrradiance * each * shown[i] * shown[j];
  }
}

LobeSet make(bool is_dice, bool is_local, std::span<const Vec3> axes) {
  KILN_CHECK(!axes.empty() && axes.size() <= kMaxLobes);
  LobeSet set{axes.size(), is_local, is_dice, {}, {}, {}, {}};
  Used all;
  for (size_t i = 0; i < set.count; ++i) {
    set.axis[i] = axes[i];
    all.at[all.count++] = i;
  }
  for (size_t i = 0; i < set.count; ++i)
    for (size_t j = 0; j <= i; ++j)
      set.gram[i][j] = set.gram[j][i] =
          pair_integral(is_dice, std::clamp(dot(DVec3(set.axis[i]), DVec3(set.axis[j])), -1.0, 1.0));
  set_metric(set);
  for (size_t i = 0; i < set.count; ++i) {
    double unit[kMaxLobes] = {}, column[kMaxLobes];
    unit[i] = 1;
    solve(set.gram, unit, all, column);
    for (size_t j = 0; j < set.count; ++j) set.inverse[j][i] = static_cast<float>(column[j]);
  }
  return set;
}

// Vogel's spiral: n points of the hemisphere about z.
template <size_t n>
std::vector<Vec3> vogel() {
  std::vector<Vec3> out;
  for (size_t i = 0; i < n; ++i) {
    const double z = 1 - (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    const float turn = 0.381966011f * static_cast<float>(i);
    const SinCos a = sincos_turns(turn - std::floor(turn));
    const auto r = static_cast<float>(std::sqrt(1 - z * z));
    out.emplace_back(r * a.cos, r * a.sin, static_cast<float>(z));
  }
  return out;
}

// Vertices of the icosahedron: the corners of three golden rectangles.
std::vector<Vec3> icosahedron() {
  constexpr float a = 0.52573111f, b = 0.85065081f;
  return {{a, 0, b},  {-a, 0, b},  {a, 0, -b}, {-a, 0, -b}, {0, b, a},  {0, b, -a},
          {0, -b, a}, {0, -b, -a}, {b, a, 0},  {-b, a, 0},  {b, -a, 0}, {-b, -a, 0}};
}

// The arrangement of Roughton 2019 for a hemisphere: a face of the icosahedron at z, without the three
// vertices below.
std::vector<Vec3> dice_of_hemisphere() {
  return {{.5257f, -.3035f, .7947f},   {-.5257f, -.3035f, .7947f}, {0, .6071f, .7947f},
          {.8507f, .4911f, .1876f},    {-.8507f, .4911f, .1876f},  {0, -.9822f, .1876f},
          {-.8507f, -.4911f, -.1876f}, {.8507f, -.4911f, -.1876f}, {0, .9822f, -.1876f}};
}

// The axes alone, for those who list the bases: the integrals of the four sets take 0.4 s.
template <std::vector<Vec3> (*kAxes)()>
std::span<const Vec3> unit_axes() {
  static const std::vector<Vec3> kUnit = [] {
    std::vector<Vec3> axes = kAxes();
    for (Vec3& axis : axes) axis = normalize_or(axis, Vec3(0, 0, 1));
    return axes;
  }();
  return kUnit;
}

template <const LobeSet& (*Set)()>
std::span<const Vec3> axes_of() {
  if constexpr (Set == ad9_lobes) return unit_axes<dice_of_hemisphere>();
  if constexpr (Set == ad12_lobes) return unit_axes<icosahedron>();
  if constexpr (Set == sg9_lobes) return unit_axes<vogel<9>>();
  if constexpr (Set == sg12_lobes) return unit_axes<vogel<12>>();
}

// Cosines of a direction with the axes.
void cosines(const LobeSet& set, const Vec3& n, const Vec3& d, float* c) {
  const Vec3 v = set.is_local ? ReceiverFrame(n).to_local(d) : d;
  for (size_t i = 0; i < set.count; ++i) c[i] = std::clamp(dot(set.axis[i], v), -1.0f, 1.0f);
}

void add_sample(const LobeSet& set, const Vec3& n, const Vec3& d, float* f) {
  float b[kMaxLobes];
  cosines(set, n, d, b);
  for (size_t i = 0; i < set.count; ++i) b[i] = lobe_radiance(set, b[i]);
  for (size_t i = 0; i < set.count; ++i) {
    float sum = 0;
    for (size_t j = 0; j < set.count; ++j) sum += set.inverse[i][j] * b[j];
    f[i] = sum;
  }
}

// The state of nearest_not_negative().
struct Nearest {
  const LobeSet& set;
  const double* weight;
  double e, lift = 0;
  Used used;
  double x[kMaxLobes], target[kMaxLobes];  // G b

  Nearest(const LobeSet& lobes, const double* weights, double sum, const double* b)
      : set(lobes), weight(weights), e(sum) {
    double shown = 0;
    for (size_t i = 0; i < set.count; ++i) {
      target[i] = 0;
      for (size_t j = 0; j < set.count; ++j) target[i] += set.metric[i][j] * b[j];
      x[i] = std::max(0.0, b[i]);
      shown += weight[i] * x[i];
      used.at[used.count++] = i;
    }
    for (size_t i = 0; i < set.count; ++i)
      x[i] = shown > 0 ? x[i] * (e / shown) : e / (static_cast<double>(set.count) * weight[i]);
  }

  // To the best point of the lobes in use, or up to where the first of them is 0. True if it was reached.
  bool advance() {
    double free[kMaxLobes] = {}, push[kMaxLobes] = {};
    solve(set.metric, target, used, free);
    solve(set.metric, weight, used, push);
    double shown = 0, gain = 0;
    for (size_t k = 0; k < used.count; ++k) {
      const size_t i = used.at[k];
      shown += weight[i] * free[i], gain += weight[i] * push[i];
    }
    lift = (e - shown) / gain;
    double share = 1;
    size_t first = set.count;  // to reach 0
    for (size_t k = 0; k < used.count; ++k) {
      const size_t i = used.at[k];
      free[i] += lift * push[i];
      if (free[i] < 0 && x[i] < share * (x[i] - free[i])) share = x[i] / (x[i] - free[i]), first = i;
    }
    Used left;
    for (size_t k = 0; k < used.count; ++k) {
      const size_t i = used.at[k];
      const bool is_blocking = i == first || (free[i] < 0 && x[i] <= share * (x[i] - free[i]));
      x[i] = is_blocking ? 0 : std::max(0.0, x[i] + share * (free[i] - x[i]));
      if (!is_blocking) left.at[left.count++] = i;
    }
    const bool reached = left.count == used.count;
    used = left;
    return reached;
  }

  // The unused lobe that lowers the distance most, if one does by more than `least`.
  bool take_back(double least) {
    bool is_used[kMaxLobes] = {};
    for (size_t k = 0; k < used.count; ++k) is_used[used.at[k]] = true;
    size_t best = set.count;
    for (size_t i = 0; i < set.count; ++i) {
      if (is_used[i]) continue;
      double slope = target[i] + lift * weight[i];
      for (size_t j = 0; j < set.count; ++j) slope -= set.metric[i][j] * x[j];
      if (slope > least) least = slope, best = i;
    }
    if (best == set.count) return false;
    used.at[used.count++] = best;
    return true;
  }
};

constexpr float kMinLight = 1e-18f;
// Lobes of both signs may show at most this many times e each at the normal, or rounding would show.
constexpr double kMostShown = 64;

// Sum of weight_i |b_i|, or of weight_i b_i.
double weighted(const LobeSet& set, const double* weight, const double* b, bool absolute) {
  double sum = 0;
  for (size_t i = 0; i < set.count; ++i) sum += weight[i] * (absolute ? std::abs(b[i]) : b[i]);
  return sum;
}

// Moves `b` to the nearest point, by set.metric, that shows e.
void move_to(const LobeSet& set, const double* weight, double e, double* b) {
  const double size = weighted(set, weight, b, true);
  if (size > kMostShown * e)
    for (size_t i = 0; i < set.count; ++i) b[i] *= kMostShown * e / size;
  double push[kMaxLobes] = {};
  Used all;
  for (size_t i = 0; i < set.count; ++i) all.at[all.count++] = i;
  solve(set.metric, weight, all, push);
  const double lift = (e - weighted(set, weight, b, false)) / weighted(set, weight, push, false);
  for (size_t i = 0; i < set.count; ++i) b[i] += lift * push[i];
}

void finish_lobes(const LobeSet& set, LobeFit fit, float e, const Vec3& n, float* f) {
  double b[kMaxLobes], weight[kMaxLobes];
  float c[kMaxLobes];
  cosines(set, n, n, c);
  for (size_t i = 0; i < set.count; ++i) {
    b[i] = f[i];
    weight[i] = kPiDouble * lobe_irradiance(set, c[i]);
  }
  if (!(e > kMinLight)) {
    // The same in every lobe.
    double sum = 0;
    for (size_t i = 0; i < set.count; ++i) sum += weight[i];
    std::fill(b, b + set.count, e > 0 ? e / sum : 0.0);
  } else if (fit == LobeFit::kPositive) {
    nearest_not_negative(set, weight, e, b);
  } else {
    move_to(set, weight, e, b);
  }
  for (size_t i = 0; i < set.count; ++i) f[i] = static_cast<float>(b[i]);
}

}  // namespace

float lobe_radiance(const LobeSet& set, float c) {
  return static_cast<float>(radiance(set.is_dice, c));
}

float lobe_irradiance(const LobeSet& set, float c) {
  if (set.is_dice) return 0.05981f + c * (0.12918f + 0.07056f * c);
  return static_cast<float>(gaussian_irradiance(c));
}

const LobeSet& ad9_lobes() {
  static const LobeSet kSet = make(true, true, axes_of<ad9_lobes>());
  return kSet;
}
const LobeSet& ad12_lobes() {
  static const LobeSet kSet = make(true, false, axes_of<ad12_lobes>());
  return kSet;
}
const LobeSet& sg9_lobes() {
  static const LobeSet kSet = make(false, true, axes_of<sg9_lobes>());
  return kSet;
}
const LobeSet& sg12_lobes() {
  static const LobeSet kSet = make(false, true, axes_of<sg12_lobes>());
  return kSet;
}

float lobes_irradiance(const LobeSet& set, const float* f, const Vec3& n, const Vec3& m) {
  float c[kMaxLobes], sum = 0;
  cosines(set, n, m, c);
  for (size_t i = 0; i < set.count; ++i) sum += f[i] * lobe_irradiance(set, c[i]);
  return kPi * sum;
}

// Lawson & Hanson 1974, chapter 23, with the one condition: from a point that obeys all conditions to the
// best one of the lobes in use; lobes that reach 0 on the way drop out, and one whose increase would lower
// the distance returns. The distance falls at every step, so no set of lobes comes twice.
void nearest_not_negative(const LobeSet& set, const double* weight, double e, double* b) {
  const size_t n = set.count;
  Nearest x(set, weight, e, b);
  for (size_t step = 0; step < 8 * n; ++step) {
    if (!x.advance()) continue;
    if (!x.take_back(1e-10 * e)) break;
  }
  double shown = 0;  // rounding may have moved it where b is large and e small
  for (size_t i = 0; i < n; ++i) shown += weight[i] * x.x[i];
  for (size_t i = 0; i < n; ++i) b[i] = x.x[i] * (e / shown);
}

template <const LobeSet& (*Set)(), size_t kCount, LobeFit kFit>
BasisInfo LobeBasis<Set, kCount, kFit>::info() {
  const bool is_dice = Set == ad9_lobes || Set == ad12_lobes, is_local = Set != ad12_lobes;
  BasisInfo b{};
  b.name = is_dice ? (kCount == 9 ? "ad9" : "ad12") : (kCount == 9 ? "sg9" : "sg12");
  b.functions = functions;
  b.is_signed = is_signed;
  b.degree = degree;
  b.band = "lobes";
  b.is_local = is_local;
  b.has_base = false;
  b.axes = axes_of<Set>();
  b.about = is_dice ? (is_local ? "RGB Ambient Dice of radiance, frame of the normal"
                                : "RGB Ambient Dice of radiance, world axes")
                    : "RGB spherical Gaussians of radiance, frame of the normal";
  b.convention =
      is_dice ? "radiance = sum Bi (.35 c^2 + .25 c^4), c = max(0, cosine to axis i); E(n)/pi = sum Bi "
                "(.05981 + .12918 c + .07056 c^2), c = n.axis"
              : "radiance = sum Bi exp(6 (c - 1)), c = cosine to axis i; E(n)/pi = sum Bi times Hill's "
                "fit of a Gaussian's irradiance";
  b.fit = kFit == LobeFit::kProject ? "project" : kFit == LobeFit::kExact ? "exact" : "positive";
  b.evaluator = "linear";
  b.irradiance = [](const float* f, const Vec3& n, const Vec3& m) {
    return lobes_irradiance(Set(), f, n, m);
  };
  if (kFit != LobeFit::kProject)
    b.finish = [](float e, const Vec3& n, float* f) { finish_lobes(Set(), kFit, e, n, f); };
  return b;
}

template <const LobeSet& (*Set)(), size_t kCount, LobeFit kFit>
void LobeBasis<Set, kCount, kFit>::evaluate(const Vec3& d, const Vec3& n, float* f) {
  add_sample(Set(), n, d, f);
}

template struct LobeBasis<ad9_lobes, 9, LobeFit::kProject>;
template struct LobeBasis<ad9_lobes, 9, LobeFit::kExact>;
template struct LobeBasis<ad9_lobes, 9, LobeFit::kPositive>;
template struct LobeBasis<ad12_lobes, 12, LobeFit::kProject>;
template struct LobeBasis<ad12_lobes, 12, LobeFit::kExact>;
template struct LobeBasis<ad12_lobes, 12, LobeFit::kPositive>;
template struct LobeBasis<sg9_lobes, 9, LobeFit::kProject>;
template struct LobeBasis<sg9_lobes, 9, LobeFit::kExact>;
template struct LobeBasis<sg9_lobes, 9, LobeFit::kPositive>;
template struct LobeBasis<sg12_lobes, 12, LobeFit::kProject>;
template struct LobeBasis<sg12_lobes, 12, LobeFit::kExact>;
template struct LobeBasis<sg12_lobes, 12, LobeFit::kPositive>;

}  // namespace kiln
