#include "coordinator/bake/sampling/texel_errors.h"

#include <cmath>
#include <limits>
#include <optional>

#include "common/base/parallel.h"
#include "common/base/zeroed.h"
#include "common/math/vec.h"
#include "coordinator/bake/lightmap/run_sums.h"
#include "coordinator/bake/sampling/alike.h"

namespace kiln {
namespace {

// Known sites of the same chart near site i, excluding i.
template <class Visit>
void for_each_near(const TexelStatistics& s, std::span<const uint32_t> chart_of_site, size_t i,
                   const Visit& visit) {
  const size_t last = std::min(s.sites, i + kVarianceNeighbours + 1);
  for (size_t j = i > kVarianceNeighbours ? i - kVarianceNeighbours : 0; j < last; ++j)
    if (j != i && s.known[j] && chart_of_site[j] == chart_of_site[i]) visit(j);
}

double half_difference(const TexelStatistics& s, size_t i) {
  return 0.5 * (double{s.luminance[0][i]} - double{s.luminance[1][i]});
}

// Variance of one sample: half the texel's own, half its neighbourhood's. `apart`: of neighbours with about
// as much light, as far as the texel's count of samples would tell: one that missed their rare bright samples
// is one of them.
double pooled_variance(const TexelStatistics& s, std::span<const uint32_t> chart_of_site, size_t i,
                       bool apart) {
  double near = 0;
  size_t neighbours = 0;
  const double samples = kReplicates * s.samples[i];
  for_each_near(s, chart_of_site, i, [&](size_t j) {
    const double variance = std::max(s.variance[i], s.variance[j]);
    if (apart && !is_as_bright(mean_luminance(s, i), mean_luminance(s, j), variance / samples)) return;
    near += double{s.variance[j]};
    ++neighbours;
  });
  if (neighbours == 0) return s.variance[i];
  return 0.5 * s.variance[i] + 0.5 * near / static_cast<double>(neighbours);
}

// How the replicates differ around a site, over what independent samples would make them differ by.
struct Difference {
  double freedom = 0;  // texels
  double q = 1;        // mean square
};

class Differences {
 public:
  // `apart`: without what texels share, which is found from texels alike.
  Differences(const TexelStatistics& s, std::span<const uint32_t> chart_of_site, bool apart)
      : independent_(s.sites) {
    ZeroedVector<double> squares(s.sites), counts(s.sites);
    for_each_index(s.sites, 0, [&](size_t i) {
      if (s.known[i]) independent_[i] = pooled_variance(s, chart_of_site, i, apart) / (2.0 * s.samples[i]);
    });
    const std::optional<AlikeRuns> runs =
        apart ? std::optional<AlikeRuns>(std::in_place, s, chart_of_site) : std::nullopt;
    std::vector<Halves> of_run(apart ? runs->count() : 0);
    for_each_index(of_run.size(), 0, [&](size_t r) {
      for (size_t j = r * kAlikeRun; j < std::min(s.sites, (r + 1) * kAlikeRun); ++j)
        of_run[r].add(halves_of(s, j));
    });
    if (apart) common_ = ZeroedVector<double>(s.sites);
    for_each_index(s.sites, 0, [&](size_t i) {
      double left = half_difference(s, i), expected = independent_[i];
      if (apart) {
        Halves alike;
        for_each_alike(
            s, chart_of_site, *runs, i, [&](size_t j) { alike.add(halves_of(s, j)); },
            [&](size_t r) { alike.add(of_run[r]); });
        find_common(s, alike, i, left, expected);
      }
      if (!(expected > kLeastLeft * independent_[i])) return;
      squares[i] = left * left / expected;
      counts[i] = 1;
    });
    square_.reserve(s.sites), count_.reserve(s.sites);
    for (size_t i = 0; i < s.sites; ++i) square_.add(squares[i]), count_.add(counts[i]);
  }
  // Variance of the mean of both replicates if samples were independent.
  double independent(size_t i) const { return independent_[i]; }
  // Variance of that mean which the difference shows to be shared; an estimate that may be negative.
  double common(size_t i) const { return common_[i]; }
  Difference around(size_t i) const {
    Difference d;
    d.freedom = count_.around(i, kReplicateNeighbours);
    if (d.freedom > 0) d.q = square_.around(i, kReplicateNeighbours) / d.freedom;
    return d;
  }

 private:
  // Sums over sites: of light, half the replicates' difference and its square, and independent_.
  struct Halves {
    double light = 0, sum = 0, squares = 0, independent = 0, count = 0;
    void add(const Halves& h) {
      light += h.light;
      sum += h.sum;
      squares += h.squares;
      independent += h.independent;
      count += h.count;
    }
  };
  Halves halves_of(const TexelStatistics& s, size_t j) const {
    const double half = half_difference(s, j);
    return {mean_luminance(s, j), half, half * half, independent_[j], 1};
  }

  // Subtracts from `left`, half a texel's difference, what texels alike have in common: the same fraction of
  // everyone's light. `expected`: the variance of the rest if samples are independent.
  void find_common(const TexelStatistics& s, const Halves& alike, size_t i, double& left, double& expected) {
    const auto& [light, sum, squares, independent, count] = alike;
    if (!(light > 0)) return;
    const double part = mean_luminance(s, i) / light;
    common_[i] = count > 1 ? part * part * count * (sum * sum - squares) / (count - 1)
                           : double{s.shared.empty() ? 0.0f : s.shared[i]} * mean_luminance(s, i) *
                                 mean_luminance(s, i);
    left -= part * sum;
    expected = independent_[i] * (1 - 2 * part) + part * part * independent;
  }

  static constexpr double kLeastLeft = 0.1;  // of a texel's variance; the rest says little where less is left
  ZeroedVector<double> independent_, common_;  // by site
  RunSums square_, count_;
};

}  // namespace

TexelErrors estimate_errors(const TexelStatistics& s, std::span<const uint32_t> chart_of_site) {
  TexelErrors out;
  out.mean.assign(s.sites, 0.0f);
  out.standard_error.assign(s.sites, std::numeric_limits<float>::infinity());
  const bool apart = !s.shared.empty();
  const Differences differences(s, chart_of_site, apart);
  for_each_index(s.sites, 0, [&](size_t i) {
    if (!s.known[i]) return;
    const Difference d = differences.around(i);
    const double independent = differences.independent(i);
    // Student's t over the normal quantile at 95 %: 1 + (z^2 + 1) / (4 freedom) + ...
    const double student = 1.0 + 1.21 / std::max(1.0, d.freedom);
    const double mean = mean_luminance(s, i);
    double variance = d.q * independent;
    // Where few texels are alike, what their differences show of it may by chance be far below 0. It must not
    // cancel the texel's own variance.
    if (apart) variance += std::max(0.0, shared_variance(s.shared[i] * mean * mean, differences.common(i)));
    out.mean[i] = static_cast<float>(mean);
    out.standard_error[i] = static_cast<float>(student * std::sqrt(variance) + 0x1p-20 * std::abs(mean));
  });
  return out;
}

std::vector<float> independent_variance(const TexelStatistics& s, std::span<const uint32_t> chart_of_site) {
  std::vector<float> out(s.sites, 0.0f);
  const Differences differences(s, chart_of_site, true);
  for_each_index(s.sites, 0, [&](size_t i) {
    if (s.known[i]) out[i] = static_cast<float>(differences.around(i).q * differences.independent(i));
  });
  return out;
}

std::vector<float> neighbourhood_means(const TexelStatistics& s, std::span<const uint32_t> chart_of_site) {
  std::vector<float> out(s.sites, 0.0f);
  for_each_index(s.sites, 0, [&](size_t i) {
    if (!s.known[i]) return;
    double near = 0;
    size_t neighbours = 0;
    for_each_near(s, chart_of_site, i, [&](size_t j) {
      near += mean_luminance(s, j);
      ++neighbours;
    });
    const double own = kReplicates * s.samples[i], share = neighbours ? kMeanDoubt / (own + kMeanDoubt) : 0;
    out[i] = static_cast<float>((1 - share) * mean_luminance(s, i) +
                                share * near / static_cast<double>(std::max<size_t>(1, neighbours)));
  });
  return out;
}

std::vector<float> effective_samples(const TexelStatistics& s, std::span<const uint32_t> chart_of_site) {
  std::vector<float> out(s.sites, 0.0f);
  for_each_index(s.sites, 0, [&](size_t i) {
    if (!s.known[i]) return;
    double sum = 0, squares = 0;
    const auto add = [&](size_t j) {
      const double mean = mean_luminance(s, j);
      sum += s.samples[j] * mean;
      squares += s.samples[j] * (double{s.variance[j]} + mean * mean);
    };
    add(i);
    for_each_near(s, chart_of_site, i, add);
    out[i] = static_cast<float>(squares > 0 ? kReplicates * sum * sum / squares : 0.0);
  });
  return out;
}

std::vector<float> samples_around(const TexelStatistics& s, std::span<const uint32_t> chart_of_site) {
  std::vector<float> out(s.sites, 0.0f);
  for_each_index(s.sites, 0, [&](size_t i) {
    if (!s.known[i]) return;
    double count = s.samples[i];
    for_each_near(s, chart_of_site, i, [&](size_t j) { count += s.samples[j]; });
    out[i] = static_cast<float>(kReplicates * count);
  });
  return out;
}

std::vector<float> band_errors(const TexelStatistics& s, std::span<const uint32_t> chart_of_site,
                               std::span<const size_t> first_planes) {
  const auto light = [&](uint32_t r, size_t i, size_t plane) {
    const float* rgb = &s.mean[r][i * s.planes + plane];
    return double{luminance(Vec3(rgb[0], rgb[1], rgb[2]))};
  };
  // [site][function] half the replicates' difference, times the root of the samples: of one variance around a
  // site if errors come from independent samples.
  const size_t functions = first_planes.size();
  std::vector<double> half(s.sites * functions, 0.0);
  for_each_index(s.sites, 0, [&](size_t i) {
    if (!s.known[i]) return;
    for (size_t f = 0; f < functions; ++f)
      half[i * functions + f] =
          0.5 * (light(0, i, first_planes[f]) - light(1, i, first_planes[f])) * std::sqrt(s.samples[i]);
  });
  std::vector<float> out(s.sites, 0.0f);
  for_each_index(s.sites, 0, [&](size_t i) {
    if (!s.known[i]) return;
    double count = 0, squares = 0, square_of_mean = 0, length2 = 0;
    for (size_t f = 0; f < functions; ++f) {
      double sum = half[i * functions + f];
      count = 1;
      squares += sum * sum;
      for_each_near(s, chart_of_site, i, [&](size_t j) {
        const double h = half[j * functions + f];
        sum += h;
        squares += h * h;
        count += 1;
      });
      square_of_mean += sum * sum / (count * count);
      const double mean = 0.5 * (light(0, i, first_planes[f]) + light(1, i, first_planes[f]));
      length2 += mean * mean;
    }
    double variance = squares / count;
    if (!s.shared.empty()) {
      const double own =
          count > 1 ? std::max(0.0, variance - square_of_mean) * count / (count - 1) : variance;
      variance = std::max(0.0, own + shared_variance(s.shared[i] * length2 * s.samples[i], variance - own));
    }
    out[i] = static_cast<float>(std::sqrt(variance / s.samples[i]));
  });
  return out;
}

std::vector<uint32_t> charts_of_sites(const Atlas& atlas) {
  std::vector<uint32_t> charts;
  charts.reserve(atlas.sites.size());
  for (const uint32_t texel : atlas.sites.texel) charts.push_back(atlas.owner[texel]);
  return charts;
}

}  // namespace kiln
