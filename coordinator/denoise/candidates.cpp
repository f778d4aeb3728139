#include "coordinator/denoise/candidates.h"

#include <cmath>

#include "coordinator/denoise/site_runs.h"

namespace kiln {
namespace {

// Of a luminance: what float paths round.
constexpr double kRounding = 0x1p-20;
constexpr double kDark = 1e-6;  // of the brightest: below this nothing is relative
constexpr uint32_t kRounds =
    16;  // steps to a linked site or none: three texels of spread, as the widest filter

std::vector<uint8_t> usable(const TexelStatistics& s, const SiteGeometry& sites) {
  std::vector<uint8_t> out(s.sites);
  for (size_t i = 0; i < s.sites; ++i)
    out[i] = s.known[i] && s.samples[i] > 0 && sites.texel_size[i] > 0 && std::isfinite(s.luminance[0][i]) &&
             std::isfinite(s.luminance[1][i]);
  return out;
}

double scale_of(const TexelStatistics& s, const std::vector<uint8_t>& known) {
  float largest = 0;
  for (size_t i = 0; i < s.sites; ++i)
    if (known[i]) largest = std::max({largest, std::abs(s.luminance[0][i]), std::abs(s.luminance[1][i])});
  return largest > 0 ? std::ldexp(1.0, std::ilogb(largest)) : 1.0;
}

// Variance of one sample. Where it is no number (squares beyond a float's range): of the square of the mean.
double sample_variance(const TexelStatistics& s, const Candidates& c, size_t i) {
  const double v = double{s.variance[i]} / c.scale / c.scale;
  const double mean = 0.5 * (double{c.value[0][0][i]} + double{c.value[1][0][i]});
  return std::isfinite(v) && v >= 0 ? v : mean * mean;
}

// Means over a site and those linked with it, the site counting twice.
void average(const std::vector<float>& in, const std::vector<uint8_t>& known, const SurfaceLinks& links,
             unsigned threads, std::vector<float>& out) {
  out.assign(in.size(), 0);
  for_each_site(in.size(), threads, [&](size_t i) {
    if (!known[i]) return;
    double sum = 2 * double{in[i]}, weight = 2;
    for (const uint32_t j : links.of(static_cast<uint32_t>(i))) {
      if (!known[j]) continue;
      sum += in[j];
      weight += 1;
    }
    out[i] = static_cast<float>(sum / weight);
  });
}

// Where a sample in ten thousand is bright, most texels have met none and their own variance is far too low;
// a filter chosen by that would take the light off the few that have and give it to nobody. So half of what
// is expected of a texel is the relative variance around it, at its own brightness.
void find_prior(const TexelStatistics& s, const SurfaceLinks& links, unsigned threads, Candidates& c) {
  std::vector<float> own(s.sites, 0), brightness(s.sites, 0), local, relative(s.sites, 0), next;
  for_each_site(s.sites, threads, [&](size_t i) {
    if (!c.known[i]) return;
    own[i] = static_cast<float>(sample_variance(s, c, i));
    brightness[i] = 0.5f * (std::abs(c.value[0][0][i]) + std::abs(c.value[1][0][i]));
  });
  average(own, c.known, links, threads, local);
  average(brightness, c.known, links, threads, next);
  brightness.swap(next);
  for_each_site(s.sites, threads, [&](size_t i) {
    const double f = brightness[i];
    if (c.known[i]) relative[i] = static_cast<float>(own[i] / (f * f + kDark * kDark));
  });
  for (uint32_t round = 0; round < kRounds; ++round) {
    average(relative, c.known, links, threads, next);
    relative.swap(next);
  }
  for_each_site(s.sites, threads, [&](size_t i) {
    if (!c.known[i]) return;
    const double f = brightness[i], around = relative[i] * (f * f + kDark * kDark);
    const double variance = 0.5 * (local[i] + around);
    c.prior[i] = static_cast<float>(variance / (2.0 * s.samples[i]) + kRounding * kRounding * f * f + 1e-30);
    c.variance[0][i] = c.prior[i];
  });
}

}  // namespace

Candidates find_candidates(const TexelStatistics& s, const SiteGeometry& sites, const SurfaceLinks& links,
                           unsigned threads) {
  Candidates c;
  c.known = usable(s, sites);
  c.scale = scale_of(s, c.known);
  c.prior.assign(s.sites, 0);
  for (uint32_t r = 0; r < kReplicates; ++r)
    for (uint32_t k = 0; k < kLevels; ++k) c.value[r][k].assign(s.sites, 0);
  for (uint32_t k = 0; k < kLevels; ++k) c.variance[k].assign(s.sites, 0);
  for (uint32_t r = 0; r < kReplicates; ++r)
    for (size_t i = 0; i < s.sites; ++i)
      if (c.known[i]) c.value[r][0][i] = static_cast<float>(s.luminance[r][i] / c.scale);

  find_prior(s, links, threads, c);

  for_each_run(s.sites, threads, [&](size_t begin, size_t end) {
    SurfaceKernel kernel(sites, links, c.known);
    SurfaceKernel::Weights weight;
    for (size_t i = begin; i < end; ++i) {
      if (!c.known[i]) continue;
      kernel.enter(static_cast<uint32_t>(i), kBandwidth[kLevels - 1]);
      const std::span<const uint32_t> window = kernel.window();
      const double own[2] = {c.value[0][0][i], c.value[1][0][i]};
      for (uint32_t k = 1; k < kLevels; ++k) {
        const size_t count = kernel.regression(k, weight);
        double change[2] = {0, 0}, variance = 0;
        for (size_t q = 0; q < count; ++q) {
          const uint32_t j = window[q];
          for (int r = 0; r < 2; ++r) change[r] += weight[q] * (double{c.value[r][0][j]} - own[r]);
          variance += weight[q] * weight[q] * double{c.prior[j]};
        }
        for (int r = 0; r < 2; ++r) c.value[r][k][i] = static_cast<float>(own[r] + change[r]);
        c.variance[k][i] = static_cast<float>(variance);
      }
    }
  });
  return c;
}

}  // namespace kiln
