#include "coordinator/denoise/candidates.h"

#include <cmath>

#include "coordinator/denoise/site_runs.h"

namespace kiln {
namespace {

// Of a luminance: what float paths round.
constexpr double kRounding = 0x1p-20;

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

  for_each_site(s.sites, threads, [&](size_t i) {
    if (!c.known[i]) return;
    // The site counts twice: where few are linked its own variance is the better guess.
    double sum = 2 * sample_variance(s, c, i), weight = 2;
    for (const uint32_t j : links.of(static_cast<uint32_t>(i))) {
      if (!c.known[j]) continue;
      sum += sample_variance(s, c, j);
      weight += 1;
    }
    const double mean = 0.5 * (double{c.value[0][0][i]} + double{c.value[1][0][i]});
    c.prior[i] =
        static_cast<float>(sum / weight / (2.0 * s.samples[i]) + kRounding * kRounding * mean * mean + 1e-30);
    c.variance[0][i] = c.prior[i];
  });

  for_each_run(s.sites, threads, [&](size_t begin, size_t end) {
    SurfaceKernel kernel(sites, links, c.known);
    SurfaceKernel::Weights weight;
    for (size_t i = begin; i < end; ++i) {
      if (!c.known[i]) continue;
      kernel.enter(static_cast<uint32_t>(i), kBandwidth[kLevels - 1]);
      const std::span<const uint32_t> window = kernel.window();
      const double own[2] = {c.value[0][0][i], c.value[1][0][i]};
      for (uint32_t k = 1; k < kLevels; ++k) {
        kernel.regression(kBandwidth[k], weight);
        double change[2] = {0, 0}, variance = 0;
        for (size_t q = 0; q < window.size(); ++q) {
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
