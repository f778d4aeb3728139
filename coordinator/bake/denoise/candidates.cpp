#include "coordinator/bake/denoise/candidates.h"

#include <cmath>

#include "common/base/parallel.h"
#include "coordinator/bake/denoise/site_average.h"
#include "coordinator/bake/lightmap/as_bright.h"

namespace kiln {
namespace {

// Relative rounding error of luminance in float paths.
constexpr double kRounding = 0x1p-20;
constexpr double kDark = 1e-6;       // of the brightest: below this errors are absolute
constexpr double kWideSamples = 16;  // with fewer samples, a texel's surroundings are the better estimate
constexpr uint32_t kRounds = 16;     // diffusion steps: a spread of three texels, as the widest filter

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

// Variance of one sample; where it is not finite (squares beyond float range), the square of the mean.
double sample_variance(const TexelStatistics& s, const Candidates& c, size_t i) {
  const double v = double{s.variance[i]} / c.scale / c.scale;
  const double mean = 0.5 * (double{c.value[0][0][i]} + double{c.value[1][0][i]});
  const double keep = std::min(c.keep[0][i], c.keep[1][i]);
  return std::isfinite(v) && v >= 0 ? keep * keep * v : mean * mean;
}

// Diffused over three texels, as far as the widest filter reaches.
std::vector<float> diffused(const std::vector<float>& in, const Candidates& c, const SurfaceLinks& links,
                            unsigned threads) {
  std::vector<float> out = in, next;
  for (uint32_t round = 0; round < kRounds; ++round) {
    average_linked(out, c.known, links, threads, next);
    out.swap(next);
  }
  return out;
}

// Per site: variance of one sample, and light.
struct Noise {
  std::vector<float> variance, light;
};

// Averages over a site and the linked sites with about as much light, as far as their samples tell.
Noise average_as_bright(const Noise& own, const Candidates& c, const SurfaceLinks& links, unsigned threads) {
  Noise out{std::vector<float>(own.light.size()), std::vector<float>(own.light.size())};
  for_each_index(own.light.size(), threads, [&](size_t i) {
    if (!c.known[i]) return;
    double variance = 2 * double{own.variance[i]}, light = 2 * double{own.light[i]}, weight = 2;
    for (const uint32_t j : links.of(static_cast<uint32_t>(i))) {
      if (!c.known[j]) continue;
      const double samples = kReplicates * std::min(c.samples[i], c.samples[j]);
      if (!is_as_bright(own.light[i], own.light[j], std::max(own.variance[i], own.variance[j]) / samples))
        continue;
      variance += own.variance[j];
      light += own.light[j];
      weight += 1;
    }
    out.variance[i] = static_cast<float>(variance / weight);
    out.light[i] = static_cast<float>(light / weight);
  });
  return out;
}

// Where one sample in ten thousand is bright, most texels have none and their own variance is far too low; a
// filter chosen by it would remove the light of the few that have one without spreading it. So half of a
// texel's expected variance is the relative variance around it, at its own brightness. With few samples even
// the brightness is unreliable: a texel that is black by chance gets the noise of its surroundings. A
// texel whose samples show that it is much darker or brighter than its surroundings gets none of their noise:
// a black one beside bright ones would state an error of many times its light.
void find_prior(const TexelStatistics& s, const SurfaceLinks& links, unsigned threads, Candidates& c) {
  Noise own{std::vector<float>(s.sites), std::vector<float>(s.sites)};
  for_each_index(s.sites, threads, [&](size_t i) {
    if (!c.known[i]) return;
    own.variance[i] = static_cast<float>(sample_variance(s, c, i));
    own.light[i] = 0.5f * (std::abs(c.value[0][0][i]) + std::abs(c.value[1][0][i]));
  });
  const Noise near = average_as_bright(own, c, links, threads);
  const std::vector<float> wide_variance = diffused(own.variance, c, links, threads);
  const std::vector<float> wide_light = diffused(own.light, c, links, threads);
  for_each_index(s.sites, threads, [&](size_t i) {
    if (!c.known[i]) return;
    const double samples = s.samples[i], wide = wide_light[i];
    const double square_of_error = std::max(own.variance[i], wide_variance[i]) / (kReplicates * samples);
    const double part =
        is_as_bright(own.light[i], wide, square_of_error) ? samples / (samples + kWideSamples) : 1;
    const double f = part * near.light[i] + (1 - part) * wide;
    const double relative = wide_variance[i] / (wide * wide + kDark * kDark);
    const double local = part * near.variance[i] + (1 - part) * wide_variance[i], around = relative * f * f;
    const double variance = 0.5 * (local + around);
    c.prior[i] = static_cast<float>(variance / (2.0 * samples) + kRounding * kRounding * f * f + 1e-30);
    c.variance[0][i] = c.prior[i];
  });
}

}  // namespace

Candidates find_candidates(const TexelStatistics& s, const SiteGeometry& sites, const SurfaceLinks& links,
                           unsigned threads, WindowTables tables) {
  Candidates c;
  c.known = usable(s, sites);
  c.scale = scale_of(s, c.known);
  c.samples = s.samples;
  c.shared = s.shared;
  c.piece = surface_pieces(c.known, links);
  c.prior.assign(s.sites, 0);
  for (uint32_t r = 0; r < kReplicates; ++r)
    for (uint32_t k = 0; k < kLevels; ++k) c.value[r][k].assign(s.sites, 0);
  for (uint32_t k = 0; k < kLevels; ++k) c.variance[k].assign(s.sites, 0);
  for (uint32_t r = 0; r < kReplicates; ++r)
    for_each_index(s.sites, threads, [&](size_t i) {
      if (c.known[i]) c.value[r][0][i] = static_cast<float>(s.luminance[r][i] / c.scale);
    });

  const Spikes spikes = find_spikes(s, c.known, c.piece, links, threads);
  for (uint32_t r = 0; r < kReplicates; ++r) {
    c.keep[r] = spikes.keep[r];
    for (size_t i = 0; i < s.sites; ++i) c.value[r][0][i] *= spikes.keep[r][i];
  }
  c.gain = spikes.gain;
  c.gain_error = spikes.relative_error;
  find_prior(s, links, threads, c);

  for_each_run(s.sites, threads, [&](size_t begin, size_t end) {
    SurfaceKernel kernel(sites, links, c.known, tables);
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
