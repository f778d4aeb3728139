#include "coordinator/bake/denoise/denoise.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "common/base/check.h"
#include "common/base/parallel.h"
#include "coordinator/bake/denoise/bounds.h"
#include "coordinator/bake/denoise/choice.h"
#include "coordinator/bake/denoise/sums.h"

namespace kiln {
namespace {

// Blend of the levels at a site: how often the sites around it chose each (Rousselle 2012, section 5.2,
// smooths the choice for the same reason: its noise would be visible).
constexpr float kChoiceTexels = 3.2f;

// Largest squared bias, over the measured variance, at which a site uses its neighbours' choice. Lower values
// reduce the gain (at 1 by a tenth); higher ones flatten peaks of one texel.
constexpr double kMaxBias = 1;

constexpr size_t kMaxPlanes = 64;  // of a basis; sh_l1 has 15

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {  // of floats too, some of them NaN
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

}  // namespace

struct ChosenFilters {
  Candidates candidates;
  Choice choice;
  // Of the statistics, what the candidates do not hold as it was.
  std::vector<float> luminance[kReplicates], variance;
  std::vector<uint8_t> known;

  bool are_of(const TexelStatistics& s) const {
    return same_bits(luminance[0], s.luminance[0]) && same_bits(luminance[1], s.luminance[1]) &&
           same_bits(variance, s.variance) && same_bits(candidates.shared, s.shared) &&
           same_bits(candidates.samples, s.samples) && same_bits(known, s.known);
  }
};

namespace {

using Shares = std::array<double, kLevels>;

class Blend {
 public:
  Blend(const Candidates& candidates, const Choice& choice, const SiteGeometry& sites,
        const SurfaceLinks& links, WindowTables tables)
      : candidates_(candidates), choice_(choice), kernel_(sites, links, candidates.known, tables) {}

  // Computes the weights of a known site.
  void enter(uint32_t site) {
    shares_ = {};
    uint32_t count = 0, widest = 0;
    for (const uint32_t j : kernel_.sites_within(site, kChoiceTexels)) {
      if (!candidates_.known[j]) continue;
      const uint32_t level = refuses(site, choice_.level[j]) ? choice_.level[site] : choice_.level[j];
      shares_[level] += 1;
      widest = std::max(widest, level);
      ++count;
    }
    for (double& share : shares_) share /= count;
    kernel_.enter(site, kBandwidth[widest]);
    weight_.fill(0);
    for (uint32_t k = 1; k <= widest; ++k) {
      if (shares_[k] == 0) continue;
      const size_t count = kernel_.regression(k, level_weight_);
      for (size_t q = 0; q < count; ++q) weight_[q] += shares_[k] * level_weight_[q];
    }
    weight_[0] += shares_[0];
  }

  std::span<const uint32_t> window() const { return kernel_.window(); }
  const SurfaceKernel::Weights& weights() const { return weight_; }
  const Shares& shares() const { return shares_; }

 private:
  // The neighbours' choice is wrong where its bias exceeds the measured noise.
  bool refuses(uint32_t site, uint32_t level) const {
    const double bias = choice_.bias[site][level];
    return bias * bias > kMaxBias * choice_.factor[site] * double{candidates_.prior[site]};
  }

  const Candidates& candidates_;
  const Choice& choice_;
  SurfaceKernel kernel_;
  SurfaceKernel::Weights weight_{}, level_weight_{};
  Shares shares_{};
};

void put_errors(const Candidates& c, const Choice& choice, const Blend& blend, size_t i, Denoised& out) {
  double value = 0, bias = 0, variance = 0;
  for (uint32_t k = 0; k < kLevels; ++k) {
    const double share = blend.shares()[k];
    value += share * 0.5 * (double{c.value[0][k][i]} + double{c.value[1][k][i]});
    bias += share * double{choice.bias[i][k]};
  }
  for (size_t q = 0; q < blend.window().size(); ++q)
    variance += blend.weights()[q] * blend.weights()[q] * double{c.prior[blend.window()[q]]};
  const double factor = choice.stated_factor[i], gain = c.gain[i], spikes = value * double{c.gain_error[i]};
  // What is measured has the part in the replicates' difference already. Both are parts of the texel's own
  // light: beside a bright texel a wide filter's light is a hundred times that of a dark one.
  const double square = value * value, measured = square * std::max(0.0f, choice.shared[i] - choice.found[i]);
  const double shared =
      (1 - blend.shares()[0]) * square * double{choice.shared[i]} + blend.shares()[0] * measured;
  out.luminance[i] = static_cast<float>(std::max(0.0, value) * gain * c.scale);
  out.standard_error[i] = static_cast<float>(
      std::sqrt(gain * gain * (factor * variance + shared + bias * bias) + spikes * spikes) * c.scale);
  out.raw_error[i] = static_cast<float>(std::sqrt(factor * double{c.prior[i]} + measured) * c.scale);
  out.strength[i] = static_cast<float>(std::clamp(1 - blend.weights()[0], 0.0, 1.0));
}

// Fallback error for sites without area or finite luminance: that of independent samples.
float lonely_error(const TexelStatistics& s, size_t i) {
  const double error = s.samples[i] > 0 ? std::sqrt(double{s.variance[i]} / (2.0 * s.samples[i]))
                                        : std::numeric_limits<double>::infinity();
  return std::isfinite(s.luminance[0][i]) && std::isfinite(s.luminance[1][i]) && std::isfinite(error)
             ? static_cast<float>(error)
             : std::numeric_limits<float>::infinity();
}

// Sums differences, so that equal values are not rounded.
void mix_planes(const TexelStatistics& s, const Candidates& c, const Blend& blend, size_t i, float* out) {
  double sum[kMaxPlanes] = {};
  const float* own[2] = {s.mean[0].data() + i * s.planes, s.mean[1].data() + i * s.planes};
  const double keep[2] = {c.keep[0][i], c.keep[1][i]};
  for (size_t q = 1; q < blend.window().size(); ++q) {
    const double w = 0.5 * blend.weights()[q];
    if (w == 0) continue;
    const size_t site = blend.window()[q], j = site * s.planes;
    const double a = c.keep[0][site], b = c.keep[1][site];
    for (size_t p = 0; p < s.planes; ++p)
      sum[p] +=
          w * ((a * s.mean[0][j + p] - keep[0] * own[0][p]) + (b * s.mean[1][j + p] - keep[1] * own[1][p]));
  }
  for (size_t p = 0; p < s.planes; ++p)
    out[p] = static_cast<float>(c.gain[i] * (0.5 * (keep[0] * own[0][p] + keep[1] * own[1][p]) + sum[p]));
}

// Bounds the reported error: a texel is never off by more than the brightest texel, and a filter chosen for
// its lower error has no higher one over a chart.
void hold_errors(const Candidates& c, const SiteGeometry& sites, Denoised& out) {
  float brightest = 0;
  uint32_t charts = 0;
  for (size_t i = 0; i < c.known.size(); ++i) {
    if (!c.known[i]) continue;
    brightest = std::max(brightest, out.luminance[i]);
    charts = std::max(charts, sites.placement[i] + 1);
  }
  std::vector<double> raw(charts, 0.0), filtered(charts, 0.0);
  for (size_t i = 0; i < c.known.size(); ++i) {
    if (!c.known[i]) continue;
    out.raw_error[i] = std::min(out.raw_error[i], brightest);
    out.standard_error[i] = std::min(out.standard_error[i], brightest);
    raw[sites.placement[i]] += out.raw_error[i];
    filtered[sites.placement[i]] += out.standard_error[i];
  }
  for (size_t i = 0; i < c.known.size(); ++i) {
    if (!c.known[i]) continue;
    const uint32_t chart = sites.placement[i];
    if (filtered[chart] > raw[chart])
      out.standard_error[i] = static_cast<float>(out.standard_error[i] * (raw[chart] / filtered[chart]));
  }
}

// Fills a site without samples from sampled sites around it: their filtered values, weighted by distance.
void fill_site(const Candidates& c, const SiteGeometry& sites, SurfaceWindow& around, size_t i, size_t planes,
               Denoised& out) {
  constexpr float kFillTexels = 9.0f;  // the first look leaves gaps of eight texels
  const float reach = kFillTexels * sites.texel_size[i];
  double weight = 0, light = 0, square = 0, errors = 0, sum[kMaxPlanes] = {};
  for (const uint32_t j : around.around(static_cast<uint32_t>(i), reach)) {
    if (!c.known[j]) continue;
    const Vec3 d = sites.position[j] - sites.position[i];
    const double off = dot(d, d) / (double{reach} * reach), w = 1 / (off * off + 1e-4);
    weight += w;
    light += w * out.luminance[j];
    square += w * out.luminance[j] * out.luminance[j];
    errors += w * out.standard_error[j];
    for (size_t p = 0; p < planes; ++p) sum[p] += w * out.mean[j * planes + p];
  }
  if (!(weight > 0)) return;
  light /= weight;
  const double spread = std::sqrt(std::max(0.0, square / weight - light * light));
  out.luminance[i] = static_cast<float>(light);
  out.standard_error[i] = static_cast<float>(std::max(errors / weight, spread));
  out.filled[i] = 1;
  out.strength[i] = 1;
  for (size_t p = 0; p < planes; ++p) out.mean[i * planes + p] = static_cast<float>(sum[p] / weight);
}

Denoised run(const TexelStatistics& s, std::span<const DirectionBound> bounds, bool planes,
             const SiteGeometry& sites, const SurfaceLinks& links, unsigned threads, KeptFilters& filters) {
  KILN_CHECK(s.planes <= kMaxPlanes && s.sites == sites.size());
  const RegularWindows regular(sites, links, threads);
  WindowTables tables{nullptr, &regular};
  std::optional<KeptWindows> kept;  // only where several loops read them
  if (!filters || !filters->are_of(s)) {
    tables.kept = &kept.emplace(s.sites);
    Candidates found = find_candidates(s, sites, links, threads, tables);
    Choice chosen = choose(found, sites, links, threads, tables);
    filters = std::make_shared<const ChosenFilters>(ChosenFilters{
        std::move(found), std::move(chosen), {s.luminance[0], s.luminance[1]}, s.variance, s.known});
  }
  const Candidates& candidates = filters->candidates;
  const Choice& choice = filters->choice;
  Denoised out;
  out.luminance.assign(s.sites, 0);
  out.standard_error.assign(s.sites, 0);
  out.raw_error.assign(s.sites, 0);
  out.strength.assign(s.sites, 0);
  out.filled.assign(s.sites, 0);
  if (planes) out.mean = ZeroedVector<float>(s.sites * s.planes);
  for_each_run(s.sites, threads, [&](size_t begin, size_t end) {
    Blend blend(candidates, choice, sites, links, tables);
    for (size_t i = begin; i < end; ++i) {
      if (candidates.known[i]) {
        blend.enter(static_cast<uint32_t>(i));
        put_errors(candidates, choice, blend, i, out);
        if (!planes) continue;
        mix_planes(s, candidates, blend, i, out.mean.data() + i * s.planes);
        hold_bounds(bounds, out.mean.data() + i * s.planes, s.planes);
      } else {
        out.luminance[i] = 0.5f * s.luminance[0][i] + 0.5f * s.luminance[1][i];
        if (s.known[i]) out.raw_error[i] = out.standard_error[i] = lonely_error(s, i);
        if (!planes || s.samples[i] == 0) continue;
        for (size_t p = i * s.planes; p < (i + 1) * s.planes; ++p)
          out.mean[p] = 0.5f * s.mean[0][p] + 0.5f * s.mean[1][p];
      }
    }
  });
  restore_sums(s, links, out);
  hold_errors(candidates, sites, out);
  for_each_run(s.sites, threads, [&](size_t begin, size_t end) {
    SurfaceWindow around(sites, links);
    for (size_t i = begin; i < end; ++i)
      if (s.samples[i] == 0 && !s.known[i] && sites.texel_size[i] > 0)
        fill_site(candidates, sites, around, i, planes ? s.planes : 0, out);
  });
  return out;
}

}  // namespace

Denoised denoise(const TexelStatistics& statistics, std::span<const DirectionBound> bounds,
                 const SiteGeometry& sites, const SurfaceLinks& links, unsigned threads,
                 KeptFilters* filters) {
  KeptFilters own;
  return run(statistics, bounds, true, sites, links, threads, filters ? *filters : own);
}

Denoised denoise_luminance(const TexelStatistics& statistics, const SiteGeometry& sites,
                           const SurfaceLinks& links, unsigned threads, KeptFilters* filters) {
  KeptFilters own;
  return run(statistics, {}, false, sites, links, threads, filters ? *filters : own);
}

}  // namespace kiln
