// With A and B the replicates, f one of the filters, t the truth: the errors of A and B are independent, so
//   (f(A) - A) (f(B) - B)  has the mean  (f(t) - t)^2,
// the square of the bias, without knowing t and without a term to subtract (two-buffer estimates: Rousselle
// 2012, section 4; Bitterli 2016, section 5.2 - there (f(A) - B)^2 less the variance of B, which has twice
// the noise). The variance of f is known. Both are means over the window in units of `prior`, so that a
// bright texel at its rim does not speak for dim ones.
#include "coordinator/denoise/choice.h"

#include <cmath>
#include <cstring>

#include "coordinator/denoise/site_runs.h"

namespace kiln {
namespace {

// A window's mean of the bias hides a texel that is sharp by itself (measured: beside small lights the error
// was twice the stated one, and above the raw one). So the bias is also asked of the texels beside it, and of
// itself where it stands out by three standard errors of its product.
constexpr float kBesideTexels = 2.0f;
constexpr double kAlone = 6;

// What all texels of a window lose or gain together counts so many times more: it is seen, and it is what
// takes light from the whole (peaks under lamps are lowered). Measured on four scenes: the loss falls by a
// fifth to a half, the gain by 0 to 5 %.
constexpr double kCommon = 5;

// Texels' worth of "samples are independent" in what is measured of their dependence: where there are few
// texels (charts of four), chance says that there is no noise at all, and texels stop at such chances.
constexpr double kDoubtTexels = 4;

// What is left of the steps to the surface of second order and between the last planes where curvature is
// constant.
double fourth_order(const Candidates& c, int replicate, size_t j) {
  const auto value = [&](uint32_t k) { return double{c.value[replicate][k][j]}; };
  return value(kQuadratic) - value(kQuadratic - 1) +
         (value(kQuadratic - 1) - value(kQuadratic - 2)) * (4.0 / 3);
}

// What is summed over windows, of one site, in units of its prior.
struct Terms {
  float noise = 0;
  float product[kLevels] = {};              // estimates squares of biases; [0] is not used
  float growth[kLevels] = {};               // of steps to the level; [0]: of fourth order
  float change[kReplicates][kLevels] = {};  // by the level, in deviations
};
constexpr size_t kTerms = 1 + kLevels * (2 + kReplicates);
static_assert(sizeof(Terms) == kTerms * sizeof(float));

Terms terms_of(const Candidates& c, size_t j) {
  Terms t;
  const double inverse = 1 / double{c.prior[j]}, root = std::sqrt(inverse);
  const double a = c.value[0][0][j], b = c.value[1][0][j];
  t.noise = static_cast<float>(inverse * (a - b) * (a - b) / 4);
  for (uint32_t k = 1; k < kLevels; ++k) {
    const double fa = c.value[0][k][j], fb = c.value[1][k][j];
    t.product[k] = static_cast<float>(inverse * (fa - a) * (fb - b));
    t.growth[k] = static_cast<float>(inverse * (fa - double{c.value[0][k - 1][j]}) *
                                     (fb - double{c.value[1][k - 1][j]}));
    t.change[0][k] = static_cast<float>(root * (fa - a));
    t.change[1][k] = static_cast<float>(root * (fb - b));
  }
  t.growth[0] = static_cast<float>(inverse * fourth_order(c, 0, j) * fourth_order(c, 1, j));
  return t;
}

// Weighted sums of terms.
struct Pool {
  double weight = 0, squares = 0, sum[kTerms] = {};
  void add(double w, const Terms& terms) {
    float t[kTerms];
    std::memcpy(t, &terms, sizeof t);
    weight += w;
    squares += w * w;
    for (size_t i = 0; i < kTerms; ++i) sum[i] += w * double{t[i]};
  }
  double noise() const { return sum[0]; }
  double product(uint32_t k) const { return sum[1 + k] / weight; }
  double growth(uint32_t k) const { return sum[1 + kLevels + k] / weight; }
  double change(uint32_t r, uint32_t k) const { return sum[1 + kLevels * (2 + r) + k] / weight; }
  // Half the standard error of a mean, over the factor: differences of replicates have twice the variance of
  // their mean. Measured of the wide one: with none of it true errors are 0.8 of the stated ones where light
  // is smooth, with all of it 1.3.
  double half_error() const { return std::sqrt(squares) / weight; }
};

// The square of the bias of level k from what one level does to another. Where light is smooth the bias of a
// fitted plane is that of curvature, c h^2: from h to 2 h it grows by 3 c h^2, so that it is a third of the
// step to the next level; of the last plane, the step to the surface of second order. That has far less noise
// than the difference from what was measured: the least of noisy risks is stated too low (a third of the true
// one, where bias and noise are alike), and with this it is not. The larger of both is taken: beside edges
// this one is too low.
double smooth_bias(const Pool& pool, uint32_t k) {
  if (k == kQuadratic)
    return 0.3 * pool.growth(0);  // measured: true errors are 0.8 to 0.95 of stated on waves
  return k + 1 == kQuadratic ? pool.growth(kQuadratic) : pool.growth(k + 1) / 9;
}

}  // namespace

Choice choose(const Candidates& c, const SiteGeometry& sites, const SurfaceLinks& links, unsigned threads) {
  Choice out;
  out.level.assign(c.known.size(), 0);
  out.factor.assign(c.known.size(), 0);
  out.bias.assign(c.known.size(), {});
  std::vector<Terms> terms(c.known.size());
  for_each_site(c.known.size(), threads, [&](size_t i) {
    if (c.known[i]) terms[i] = terms_of(c, i);
  });
  for_each_run(c.known.size(), threads, [&](size_t begin, size_t end) {
    SurfaceKernel kernel(sites, links, c.known);
    for (size_t i = begin; i < end; ++i) {
      if (!c.known[i]) continue;
      constexpr float kPooled = kBandwidth[kLevels - 1];
      kernel.enter(static_cast<uint32_t>(i), kPooled);
      const std::span<const uint32_t> window = kernel.window();
      Pool wide, beside;
      for (size_t q = 0; q < window.size(); ++q) {
        const Terms& of = terms[window[q]];
        wide.add(kernel.falloff(q, kPooled), of);
        if (const double w = kernel.falloff(q, kBesideTexels); w > 0) beside.add(w, of);
      }
      // What low-discrepancy sampling makes of the variance of independent samples.
      const double factor = (wide.noise() + kDoubtTexels) / (wide.weight + kDoubtTexels);
      out.factor[i] = static_cast<float>(factor);
      const double wide_error = factor * wide.half_error(), beside_error = factor * beside.half_error();
      const double prior = c.prior[i];
      double least = factor * double{c.variance[0][i]};
      for (uint32_t k = 1; k < kLevels; ++k) {
        const double smooth = smooth_bias(wide, k), direct = wide.product(k);
        const double alone = terms[i].product[k];
        const double sharp = std::max(beside.product(k) - beside_error, alone - kAlone * factor);
        const double common = wide.change(0, k) * wide.change(1, k);
        const double bias = std::max({direct, smooth, sharp}) + kCommon * common;
        const double risk = factor * double{c.variance[k][i]} + bias * prior;
        // The largest of noisy numbers is too large in the mean: stated is what stands out.
        const double stated = std::max({0.0, smooth, direct - wide_error, sharp});
        out.bias[i][k] = static_cast<float>(std::sqrt(stated * prior));
        if (risk >= least) continue;
        least = risk;
        out.level[i] = static_cast<uint8_t>(k);
      }
    }
  });
  return out;
}

}  // namespace kiln
