#include "coordinator/measure/compare/measures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/format.h"
#include "common/base/statistics.h"
#include "coordinator/measure/compare/ssim.h"

namespace kiln {
namespace {

// A texel that counts.
struct Pair {
  size_t index;
  double a, b1, b2, floor;          // floor: squared, added to the denominator of relative errors
  double stated, reference_stated;  // standard errors; 0: unknown
  double r() const { return 0.5 * (b1 + b2); }
  double squared() const { return (a - b1) * (a - b2); }
  double scale() const { return r() * r() + floor; }
  double away() const { return std::fabs(a - r()); }
};

Status check_layout(const ErrorMap& a, const ErrorMap& b) {
  if (a.width == b.width && a.page_height == b.page_height && a.pages == b.pages) return {};
  const auto size = [](const ErrorMap& m) {
    return text("{}x{}{}", m.width, m.page_height, m.pages > 1 ? text(" on {} pages", m.pages) : "");
  };
  return fail(
      ErrorKind::kUsage,
      text(
          "{} and {} have {} and {} texels: only bakes of one layout compare; bake both with the same scene, "
          "density and layout, or with --keep-layout",
          a.name, b.name, size(a), size(b)));
}

std::vector<Pair> pairs_of(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2) {
  std::vector<Pair> pairs;
  double mean = 0;
  for (size_t i = 0; i < a.light.size(); ++i) {
    if (!a.measured[i] || !b.measured[i] || (b2 && !b2->measured[i])) continue;
    const double second = b2 ? b2->light[i] : b.light[i];
    pairs.push_back({i, a.light[i], b.light[i], second, 0, a.stated.empty() ? 0 : a.stated[i],
                     b.stated.empty() || b2 ? 0 : b.stated[i]});
    mean += pairs.back().r();
  }
  mean /= static_cast<double>(std::max<size_t>(1, pairs.size()));
  // Two black maps are equal: define 0 / 0 as 0.
  for (Pair& p : pairs) p.floor = std::max(1e-4 * mean * mean, std::numeric_limits<double>::min());
  return pairs;
}

template <class F>
double mean_of(const std::vector<Pair>& pairs, const F& f) {
  double sum = 0;
  for (const Pair& p : pairs) sum += f(p);
  return pairs.empty() ? 0 : sum / static_cast<double>(pairs.size());
}

void measure_reference(const std::vector<Pair>& pairs, bool halves, bool stated, Comparison& c) {
  const auto variance = [&](const Pair& p) {
    return halves ? 0.25 * (p.b1 - p.b2) * (p.b1 - p.b2) : p.reference_stated * p.reference_stated;
  };
  if (!halves && !stated) return;
  c.reference_rel_mse = mean_of(pairs, [&](const Pair& p) { return variance(p) / p.scale(); });
  if (halves) c.bias_error = std::sqrt(mean_of(pairs, variance) / static_cast<double>(pairs.size()));
}

// Texels below this share of the map's mean are as good as black: their relative errors mean nothing.
constexpr double kBlackShare = 0.01;

Calibration calibrate(const std::vector<Pair>& pairs, bool halves, const CompareSettings& s) {
  const double z = normal_interval(s.confidence);
  Calibration c;
  double brightest = 0;
  double ratio = 0, squares = 0, noise = 0, stated = 0, kept = 0, relative_squares = 0;
  uint64_t lit = 0, known = 0, finite = 0;
  const double black = kBlackShare * mean_of(pairs, [](const Pair& p) { return p.a; });
  for (const Pair& p : pairs) {
    const bool covered = p.away() <= z * p.stated;
    c.coverage += covered;
    const bool promised = p.a > 0 && z * p.stated <= s.error * p.a;
    c.promised += promised;
    brightest = std::max(brightest, p.a);
    if (std::isfinite(p.stated)) c.largest_stated = std::max(c.largest_stated, p.stated);
    kept += promised && p.away() <= s.error * p.r();
    if (!std::isfinite(p.stated)) continue;
    relative_squares += std::min(p.stated * p.stated / p.scale(), std::max(1.0, p.a * p.a / p.floor));
    ++finite;
    if (!(p.a > black)) continue;
    squares += p.stated * p.stated / (p.a * p.a);
    ++lit;
    if (!(p.stated > 0)) continue;
    ratio += p.squared() / (p.stated * p.stated);
    ++known;
    stated += p.stated * p.stated;
    noise += halves ? 0.25 * (p.b1 - p.b2) * (p.b1 - p.b2) : p.reference_stated * p.reference_stated;
  }
  if (brightest > 0) c.largest_stated /= brightest;
  c.coverage /= static_cast<double>(pairs.size());
  c.stated_rel_mse = finite ? relative_squares / static_cast<double>(finite) : 0;
  c.stated_rms = lit ? std::sqrt(squares / static_cast<double>(lit)) : 0;
  c.error_ratio = known ? std::sqrt(std::max(0.0, ratio / static_cast<double>(known))) : 0;
  c.promise_kept = c.promised ? kept / static_cast<double>(c.promised) : 0;
  c.reference_part = stated > 0 ? noise / stated : 0;
  return c;
}

double relative(const Pair& p) {
  return p.away() / std::sqrt(p.scale());
}

void list_worst(std::vector<Pair> pairs, const ErrorMap& a, size_t count, Comparison& c) {
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& x, const Pair& y) { return relative(x) > relative(y); });
  const size_t n = pairs.size();
  for (size_t k = 0; k < std::size(kComparePercentiles); ++k) {
    // The given percentiles of the texels.
    const auto rank = static_cast<size_t>(std::ceil(kComparePercentiles[k] / 100 * static_cast<double>(n)));
    c.percentiles[k] = relative(pairs[n - std::clamp<size_t>(rank, 1, n)]);
  }
  for (size_t i = 0; i < std::min(count, n); ++i) {
    const Pair& p = pairs[i];
    const size_t row = p.index / a.width;
    WorstTexel w;
    w.x = static_cast<uint32_t>(p.index % a.width);
    w.y = static_cast<uint32_t>(row % a.page_height);
    w.page = static_cast<uint32_t>(row / a.page_height);
    w.a = p.a;
    w.reference = p.r();
    w.stated = p.stated;
    c.worst.push_back(std::move(w));
  }
}

}  // namespace

double Comparison::rmse() const {
  return std::sqrt(std::max(0.0, mse));
}

Expected<Comparison> compare_maps(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2,
                                  const CompareSettings& settings) {
  KILN_TRY_STATUS(check_layout(a, b));
  if (b2) KILN_TRY_STATUS(check_layout(a, *b2));
  const std::vector<Pair> pairs = pairs_of(a, b, b2);
  if (pairs.empty())
    return fail(ErrorKind::kUsage, text("{} and {} have no measured texel in common", a.name, b.name));
  if (b2 && std::all_of(pairs.begin(), pairs.end(), [](const Pair& p) { return p.b1 == p.b2; }) &&
      std::any_of(pairs.begin(), pairs.end(), [](const Pair& p) { return p.b1 != 0; }))
    return fail(ErrorKind::kUsage,
                text("{} and {} are equal in every texel: the two halves of a reference are bakes "
                     "with two values of --seed",
                     b.name, b2->name));
  Comparison c;
  const auto n = static_cast<double>(pairs.size());
  c.texels = pairs.size();
  c.mean_a = mean_of(pairs, [](const Pair& p) { return p.a; });
  c.mean_reference = mean_of(pairs, [](const Pair& p) { return p.r(); });
  c.bias = c.mean_a - c.mean_reference;
  c.mse = mean_of(pairs, [](const Pair& p) { return p.squared(); });
  c.rel_mse = mean_of(pairs, [](const Pair& p) { return p.squared() / p.scale(); });
  const double scatter = mean_of(pairs, [&](const Pair& p) {
    const double d = p.squared() / p.scale() - c.rel_mse;
    return d * d;
  });
  c.rel_mse_error = std::sqrt(scatter / n);
  c.within = mean_of(pairs, [&](const Pair& p) { return p.away() <= settings.error * p.r() ? 1.0 : 0.0; });
  measure_reference(pairs, b2 != nullptr, !b2 && !b.stated.empty(), c);
  if (!a.stated.empty()) c.calibration = calibrate(pairs, b2 != nullptr, settings);
  c.ssim = structural_similarity(a, b, b2);
  if (b2) c.reference_ssim = structural_similarity(b, *b2, nullptr);
  list_worst(pairs, a, settings.worst, c);
  return c;
}

std::vector<double> relative_differences(const ErrorMap& a, const ErrorMap& b, const ErrorMap* b2) {
  std::vector<double> out(a.light.size(), std::numeric_limits<double>::quiet_NaN());
  for (const Pair& p : pairs_of(a, b, b2)) out[p.index] = (p.a - p.r()) / std::sqrt(p.scale());
  return out;
}

}  // namespace kiln
