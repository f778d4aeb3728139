// Let A and B be the replicates, f a filter and t the truth. The errors of A and B are independent, so
//   (f(A) - A) (f(B) - B)  has the mean  (f(t) - t)^2,
// the square of the bias, without t and without a term to subtract (two-buffer estimates: Rousselle 2012,
// section 4; Bitterli 2016, section 5.2 - there (f(A) - B)^2 less the variance of B, which has twice the
// noise). The variance of f is known. Both are averaged over the window in units of `prior`, so that a bright
// texel at its rim does not dominate dim ones; kMostScale keeps a dark one from dominating brighter ones.
#include "coordinator/bake/denoise/choice.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/atlas/sites.h"
#include "common/base/parallel.h"
#include "coordinator/bake/lightmap/run_sums.h"

namespace kiln {
namespace {

// The window's mean bias hides a single sharp texel (measured: beside small lights the error was twice the
// reported one, and above the raw one). So the bias is also estimated from the adjacent texels, and from the
// texel itself where it exceeds three standard errors of its product.
constexpr float kBesideTexels = 2.0f;
constexpr double kAlone = 6;
// All samples are dark by chance once in exp(this); at 6 that would be one texel in 400.
constexpr double kAloneDark = 12;
// The mean product of the texels beside counts beyond this many times the noise expected of it. At 1 single
// texels of even walls kept their noise, as specks.
constexpr double kFewBeside = 3;
constexpr double kFewAlone = 8;  // samples: of fewer, coincidences of rare bright ones are no surprise; that
                                 // all samples of both replicates are dark is one as rare as it looks

// What a texel of less noise says of a site's squared bias counts at most this many times. The prior of a
// texel that has met almost no light may be 1e-10 of the site's; whatever light a filter brings there is then
// worth 1e10 of its priors, and the site would state an error a million times its light.
constexpr float kMostScale = 16;

// A bias counts only beyond this many standard errors: in the choice of filter, and in the reported error. Of
// the few texels beside, as many in both: their mean has ten times the noise of what a wide filter leaves,
// and would be most of the error that is stated there.
constexpr double kChoiceErrors = 1.0, kStatedErrors = 0.25, kBesideErrors = 1.0;

// Expected bias of a level where nothing is known, relative to the light, limited to this many standard
// errors of the measurement.
constexpr double kDoubtErrors = 0.25;
constexpr double kExpectedBias[kLevels] = {0, 0.02, 0.05, 0.1, 0.1};

// A loss or gain common to a whole window counts this many times more: it is visible, and it removes light
// from the map (it lowers peaks under lamps). Measured on four scenes: the loss falls by a fifth to a half,
// the gain by 0 to 5 %.
constexpr double kCommon = 5;

// The variance of a window's texels, relative to that of independent samples, is measured. A chart of four
// texels may show no noise by chance, and sampling would stop there, so more texels are added to the mean.
// For the choice of filter these have independent samples: too much smoothing does less harm than noise that
// stays. What is stated would be up to twice the true variance that way, because low-discrepancy samples do
// much better than independent ones; there the added texels have the mean of this many sites on either side.
constexpr double kDoubtTexels = 4, kUsualTexels = 16;
constexpr size_t kUsualSites = 128;
// There a texel's noise counts as this at most, four standard deviations. All samples of a cavity may see the
// same light of the cache: then its replicates differ by hundreds of times its prior. That is stated as
// shared, and says nothing of other texels.
constexpr double kMostUsual = 16;

// The remaining bias after the steps to the quadratic surface and between the last planes, where curvature is
// constant.
double fourth_order(const Candidates& c, int replicate, size_t j) {
  const auto value = [&](uint32_t k) { return double{c.value[replicate][k][j]}; };
  return value(kQuadratic) - value(kQuadratic - 1) +
         (value(kQuadratic - 1) - value(kQuadratic - 2)) * (4.0 / 3);
}

// Texels that end their paths at the same irradiance cache share its error: it is in the difference of the
// replicates, whose caches are their own, but a filter does not average it away. It is measured as the
// difference of both replicates' widest planes beyond that of independent texels. Relative to the light it is
// nearly constant over a connected surface (walls of a room lit through a slit), so it is measured over the
// whole piece: if all texels share an error, a window knows no more than one texel.
class SharedError {
 public:
  explicit SharedError(const Candidates& c) : piece_(c.piece), sums_(c.piece.size()) {}

  // For a site whose measured variance is `factor` times the expected one.
  void add(const Candidates& c, size_t i, double factor) {
    const double light = square_of_light(c, i), variance = factor * double{c.variance[kLevel][i]};
    if (!(light > 0)) return;
    const double half = 0.5 * (double{c.value[0][kLevel][i]} - double{c.value[1][kLevel][i]});
    const double relative = variance / light, excess = (half * half - variance) / light;
    const double weight = std::min(1.0, (kSure / relative) * (kSure / relative));
    Sums& s = sums_[piece_[i]];
    s.weight += fixed(weight);
    s.excess += fixed(weight * std::clamp(excess, -1.0, 1.0));
    s.squares += fixed(weight * weight);
    s.noise += fixed(weight * weight * std::min(relative, 1.0));
  }

  // Relative variance by the difference, minus half a standard error.
  double found(size_t i) const {
    const Sums& s = sums_[piece_[i]];
    if (s.weight <= 0) return 0;
    const double weight = plain(s.weight);
    // The square of a normal variable has variance 2 s^4; windows overlap.
    const double noise = s.squares > 0 ? plain(s.noise) / plain(s.squares) : 0;
    const double error = noise * std::sqrt(2.0 * kFootprint * plain(s.squares)) / weight;
    return std::max(0.0, plain(s.excess) / weight - 0.5 * error);
  }
  // With the errors drawn of the caches, which are many draws where the difference is one.
  double of(const Candidates& c, size_t i, double found) const {
    return c.shared.empty() ? found : shared_variance(double{c.shared[i]}, found);
  }

 private:
  static constexpr uint32_t kLevel = kQuadratic - 1;
  static constexpr double kSure = 1e-4;     // relative variance above which a texel has less weight
  static constexpr double kFootprint = 64;  // effective texels of a window
  // Integer sums: the same in any order of sites.
  struct Sums {
    int64_t weight = 0, excess = 0, squares = 0, noise = 0;
  };
  static int64_t fixed(double v) { return std::llround(std::ldexp(v, 32)); }
  static double plain(int64_t v) { return std::ldexp(static_cast<double>(v), -32); }
  static double square_of_light(const Candidates& c, size_t i) {
    const double f = 0.5 * (double{c.value[0][kLevel][i]} + double{c.value[1][kLevel][i]});
    return f * f;
  }
  const std::vector<uint32_t>& piece_;
  std::vector<Sums> sums_;  // by piece
};

// Terms of one site, summed over windows, in units of its prior.
struct Terms {
  float noise = 0;
  float product[kLevels] = {};              // estimate of the squared bias; [0] is unused
  float growth[kLevels] = {};               // for steps to the level; [0]: fourth order
  float change[kReplicates][kLevels] = {};  // by level, in standard deviations
};
constexpr size_t kTerms = 1 + kLevels * (2 + kReplicates);
static_assert(sizeof(Terms) == kTerms * sizeof(float));
constexpr size_t kLanes = (kTerms + 3) / 4 * 4;  // padded with zeros, so that the loops vectorise

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

// By site: measured variance over that of independent samples, usual around it. In an order of its own,
// because joined texels have another than sites.
std::vector<float> usual_factors(const Candidates& c, const std::vector<Terms>& terms,
                                 const std::vector<Vec3>& position, unsigned threads) {
  const std::vector<uint32_t> order = morton_order(position, threads);
  RunSums noise, count;
  for (const uint32_t i : order) {
    noise.add(c.known[i] ? std::min(double{terms[i].noise}, kMostUsual) : 0.0);
    count.add(c.known[i] ? 1 : 0);
  }
  std::vector<float> out(terms.size());
  for (size_t k = 0; k < order.size(); ++k)
    out[order[k]] = static_cast<float>((noise.around(k, kUsualSites) + kDoubtTexels) /
                                       (count.around(k, kUsualSites) + kDoubtTexels));
  return out;
}

// Weighted sums of terms and of their squares.
class Pool {
 public:
  // `scale`: factor on the squared biases, at most 1.
  void add(float w, const Terms& terms, float scale) {
    float t[kLanes] = {};
    std::memcpy(t, &terms, sizeof terms);
    if (scale < 1) {
      const float root = std::sqrt(scale);
      for (size_t i = 1; i < kTerms; ++i) t[i] *= i <= 2 * kLevels ? scale : root;
    }
    weight_ += w;
    squares_ += w * w;
    for (size_t i = 0; i < kLanes; ++i) {
      const float weighted = w * t[i];
      sum_[i] += weighted;
      square_[i] += weighted * weighted;
    }
  }
  double weight() const { return weight_; }
  double noise() const { return sum_[0]; }
  // Means of products minus this many standard errors. The error is that of the terms themselves: with rare
  // bright samples a few texels make up the mean, and a coincidence of two of them is never significant
  // (Student 1908; de la Pena et al. 2009 on self-normalised sums).
  double product(uint32_t k, double errors) const { return beyond(1 + k, errors); }
  double growth(uint32_t k, double errors) const { return beyond(1 + kLevels + k, errors); }
  double product_error(uint32_t k) const { return std::sqrt(double{square_[1 + k]}) / weight_; }
  // By that test a single sharp texel is never significant in its window's mean. It can be by the expected
  // noise of the terms, `deviation` each.
  double sharp(uint32_t k, double deviation) const {
    return (sum_[1 + k] - deviation * std::sqrt(double{squares_})) / weight_;
  }
  // The product of both replicates' changes.
  double common(uint32_t k, double errors) const {
    const size_t a = 1 + kLevels * 2 + k, b = a + kLevels;
    const double product = double{sum_[a]} * sum_[b], error = std::sqrt(double{square_[a]} * square_[b]);
    return std::max(0.0, product - errors * error) / (double{weight_} * weight_);
  }

 private:
  double beyond(size_t i, double errors) const {
    return (double{sum_[i]} - errors * std::sqrt(double{square_[i]})) / weight_;
  }
  float weight_ = 0, squares_ = 0, sum_[kLanes] = {}, square_[kLanes] = {};
};

// The squared bias of level k, from the step between levels. Where light is smooth, the bias of a fitted
// plane comes from curvature, c h^2: from h to 2 h it grows by 3 c h^2, so it is a third of the step to the
// next level; for the last plane, the step to the quadratic surface. This has far less noise than the
// difference from the measurement: the minimum of noisy risks is biased low (to a third of the true risk
// where bias and noise are alike), and this avoids it. The larger of both is used, because this one is too
// low beside edges.
double smooth_bias(const Pool& pool, uint32_t k, double errors) {
  if (k == kQuadratic)
    return 0.3 *
           pool.growth(0, errors);  // measured: true errors are 0.8 to 0.95 of the reported ones on waves
  return k + 1 == kQuadratic ? pool.growth(kQuadratic, errors) : pool.growth(k + 1, errors) / 9;
}

}  // namespace

Choice choose(const Candidates& c, const SiteGeometry& sites, const SurfaceLinks& links, unsigned threads,
              WindowTables tables) {
  Choice out;
  out.level.assign(c.known.size(), 0);
  out.factor.assign(c.known.size(), 0);
  out.stated_factor.assign(c.known.size(), 0);
  out.bias.assign(c.known.size(), {});
  out.found.assign(c.known.size(), 0);
  out.shared.assign(c.known.size(), 0);
  std::vector<Terms> terms(c.known.size());
  for_each_index(c.known.size(), threads, [&](size_t i) {
    if (c.known[i]) terms[i] = terms_of(c, i);
  });
  const std::vector<float> usual = usual_factors(c, terms, sites.position, threads);
  for_each_run(c.known.size(), threads, [&](size_t begin, size_t end) {
    SurfaceKernel kernel(sites, links, c.known, tables);
    for (size_t i = begin; i < end; ++i) {
      if (!c.known[i]) continue;
      constexpr float kPooled = kBandwidth[kLevels - 1];
      kernel.enter(static_cast<uint32_t>(i), kPooled);
      const std::span<const uint32_t> window = kernel.window();
      Pool wide, beside;
      for (size_t q = 0; q < window.size(); ++q) {
        const Terms& of = terms[window[q]];
        const float scale = std::min(1.0f, kMostScale * c.prior[window[q]] / c.prior[i]);
        wide.add(static_cast<float>(kernel.falloff(q, kPooled)), of, scale);
        if (const double w = kernel.falloff(q, kBesideTexels); w > 0)
          beside.add(static_cast<float>(w), of, scale);
      }
      // Variance with low-discrepancy sampling relative to independent samples.
      const double factor = (wide.noise() + kDoubtTexels) / (wide.weight() + kDoubtTexels);
      out.factor[i] = static_cast<float>(factor);
      out.stated_factor[i] = static_cast<float>((wide.noise() + kUsualTexels * double{usual[i]}) /
                                                (wide.weight() + kUsualTexels));
      const double prior = c.prior[i], light = 0.5 * (double{c.value[0][kQuadratic - 1][i]} +
                                                      double{c.value[1][kQuadratic - 1][i]});
      const double dark_errors = kAloneDark * factor,
                   bright_errors = kAlone * factor * (1 + kFewAlone / c.samples[i]);
      double least = factor * double{c.variance[0][i]};
      for (uint32_t k = 1; k < kLevels; ++k) {
        const double alone = terms[i].product[k] - (terms[i].change[0][k] > 0 ? dark_errors : bright_errors);
        const double few = kFewBeside * (1 + kFewAlone / c.samples[i]) * factor;
        const double sharp = std::max({beside.product(k, kBesideErrors), beside.sharp(k, few), alone});
        const auto bias = [&](double errors) {
          return std::max({0.0, wide.product(k, errors), smooth_bias(wide, k, errors), sharp});
        };
        const double expected = kExpectedBias[k] * light;
        const double doubt = std::min(expected * expected, kDoubtErrors * wide.product_error(k) * prior);
        const double risk = factor * double{c.variance[k][i]} + doubt +
                            (bias(kChoiceErrors) + kCommon * wide.common(k, kChoiceErrors)) * prior;
        out.bias[i][k] = static_cast<float>(std::sqrt(bias(kStatedErrors) * prior));
        if (risk >= least) continue;
        least = risk;
        out.level[i] = static_cast<uint8_t>(k);
      }
    }
  });
  SharedError shared(c);
  for (size_t i = 0; i < c.known.size(); ++i)
    if (c.known[i]) shared.add(c, i, out.stated_factor[i]);
  for_each_index(c.known.size(), threads, [&](size_t i) {
    if (!c.known[i]) return;
    out.found[i] = static_cast<float>(shared.found(i));
    out.shared[i] = static_cast<float>(shared.of(c, i, double{out.found[i]}));
  });
  return out;
}

}  // namespace kiln
