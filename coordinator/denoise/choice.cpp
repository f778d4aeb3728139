// With A and B the replicates, f one of the filters, t the truth: the errors of A and B are independent, so
//   (f(A) - A) (f(B) - B)  has the mean  (f(t) - t)^2,
// the square of the bias, without knowing t and without a term to subtract (two-buffer estimates: Rousselle
// 2012, section 4; Bitterli 2016, section 5.2 - there (f(A) - B)^2 less the variance of B, which has twice
// the noise). The variance of f is known. Both are means over the window in units of `prior`, so that a
// bright texel at its rim does not speak for dim ones.
#include "coordinator/denoise/choice.h"

#include "coordinator/denoise/site_runs.h"

namespace kiln {
namespace {

// The square of the bias of level k from what one level does to another. Where light is smooth a regression's
// bias is that of curvature, c h^2: from h to 2 h it grows by 3 c h^2, so that it is a third of the step to
// the next level; of the last level, 4/3 of the step to it. That has far less noise than the difference from
// what was measured: the least of four noisy risks is stated too low (a third of the true one, where bias and
// noise are alike), and with this it is not. The larger of both is taken: beside edges this one is too low.
double smooth_bias(const double (&growth)[kLevels], uint32_t k) {
  return k + 1 < kLevels ? growth[k + 1] / 9 : growth[k] * 16 / 9;
}

}  // namespace

Choice choose(const Candidates& c, const SiteGeometry& sites, const SurfaceLinks& links, unsigned threads) {
  Choice out;
  out.level.assign(c.known.size(), 0);
  out.risk.assign(c.known.size(), {});
  for_each_run(c.known.size(), threads, [&](size_t begin, size_t end) {
    SurfaceKernel kernel(sites, links, c.known);
    for (size_t i = begin; i < end; ++i) {
      if (!c.known[i]) continue;
      constexpr float kPooled = kBandwidth[kLevels - 1];
      kernel.enter(static_cast<uint32_t>(i), kPooled);
      const std::span<const uint32_t> window = kernel.window();
      double weight = 0, noise = 0, bias[kLevels] = {}, growth[kLevels] = {};
      for (size_t q = 0; q < window.size(); ++q) {
        const uint32_t j = window[q];
        const double w = kernel.falloff(q, kPooled), per = w / double{c.prior[j]};
        const double a = c.value[0][0][j], b = c.value[1][0][j];
        weight += w;
        noise += per * (a - b) * (a - b) / 4;
        for (uint32_t k = 1; k < kLevels; ++k) {
          const double fa = c.value[0][k][j], fb = c.value[1][k][j];
          bias[k] += per * (fa - a) * (fb - b);
          growth[k] += per * (fa - double{c.value[0][k - 1][j]}) * (fb - double{c.value[1][k - 1][j]});
        }
      }
      // What low-discrepancy sampling makes of the variance of independent samples.
      const double factor = noise / weight;
      std::array<float, kLevels>& risk = out.risk[i];
      for (uint32_t k = 0; k < kLevels; ++k) {
        const double variance = factor * double{c.variance[k][i]};
        const double square = k == 0 ? 0.0 : std::max(bias[k], smooth_bias(growth, k));
        const double estimate = variance + square / weight * double{c.prior[i]};
        if (k == 0 || estimate < double{risk[out.level[i]]}) out.level[i] = static_cast<uint8_t>(k);
        // Stated is never less than the variance.
        risk[k] = static_cast<float>(std::max(estimate, variance));
      }
    }
  });
  return out;
}

}  // namespace kiln
