#include "coordinator/bake/collapse/judge.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/base/parallel.h"
#include "common/math/vec.h"

namespace kiln {
namespace {

// The two replicates' values of one function in one colour (3: luminance) at a site.
class Pairs {
 public:
  Pairs(const TexelStatistics& s, std::span<const uint32_t> sites, size_t first_plane, size_t colour)
      : s_(s), sites_(sites), plane_(first_plane), colour_(colour) {}

  double value(uint32_t replicate, size_t i) const {
    const float* rgb = &s_.mean[replicate][sites_[i] * s_.planes + plane_];
    return colour_ < 3 ? double{rgb[colour_]} : luminance(DVec3(rgb[0], rgb[1], rgb[2]));
  }
  double mean(uint32_t replicate) const {
    double sum = 0;
    for (size_t i = 0; i < sites_.size(); ++i) sum += value(replicate, i);
    return sum / static_cast<double>(sites_.size());
  }
  // Mean over texels [first, last) of the product of both replicates' deviations from these centres.
  double square(size_t first, size_t last, double a, double b) const {
    double sum = 0;
    for (size_t i = first; i < last; ++i) sum += (value(0, i) - a) * (value(1, i) - b);
    return sum / static_cast<double>(last - first);
  }
  // Variance of one replicate's noise.
  double noise(size_t first, size_t last) const {
    double sum = 0;
    for (size_t i = first; i < last; ++i) {
      const double d = value(0, i) - value(1, i);
      sum += 0.5 * d * d;
    }
    return sum / static_cast<double>(last - first);
  }

 private:
  const TexelStatistics& s_;
  const std::span<const uint32_t> sites_;
  const size_t plane_, colour_;
};

// The functions of a band in one colour; squares are sums over them.
class BandTest {
 public:
  BandTest(const TexelStatistics& s, std::span<const uint32_t> sites, const EvenBand& band, size_t colour)
      : count_(sites.size()) {
    for (const size_t plane : band.first_planes) {
      const Pairs& pairs = functions_.emplace_back(s, sites, plane, colour);
      mean_[0].push_back(pairs.mean(0));
      mean_[1].push_back(pairs.mean(1));
      noise_.push_back(pairs.noise(0, count_));
    }
  }

  // Upper confidence limit of the mean square over the chart, to compare with `tolerance`.
  double limit(double tolerance) const {
    double square = 0;
    for (size_t f = 0; f < functions_.size(); ++f)
      square += functions_[f].square(0, count_, mean_[0][f], mean_[1][f]);
    return std::max(0.0, square) + kSure * error(noise_, tolerance, count_);
  }

  bool blocks_are_within(double tolerance) const {
    const size_t blocks = std::max<size_t>(1, count_ / kBlockTexels);
    for (size_t b = 0; b < blocks; ++b)
      if (!block_is_within(b * count_ / blocks, (b + 1) * count_ / blocks, tolerance)) return false;
    return true;
  }

 private:
  bool block_is_within(size_t first, size_t last, double tolerance) const {
    std::vector<double> noise;
    double square = 0, both = 0;
    for (size_t f = 0; f < functions_.size(); ++f) {
      noise.push_back(std::max(noise_[f], functions_[f].noise(first, last)));
      square += functions_[f].square(first, last, centre(f), centre(f));
      both += 0.5 * noise.back();  // of the mean of two replicates
    }
    if (!(square + kSure * error(noise, tolerance, last - first) <= tolerance)) return false;
    const double far = std::sqrt(tolerance) + kFar * std::sqrt(both);
    for (size_t i = first; i < last; ++i) {
      double distance = 0;
      for (size_t f = 0; f < functions_.size(); ++f) {
        const double d = 0.5 * (functions_[f].value(0, i) + functions_[f].value(1, i)) - centre(f);
        distance += d * d;
      }
      if (!(distance <= far * far)) return false;
    }
    return true;
  }
  double centre(size_t f) const { return 0.5 * (mean_[0][f] + mean_[1][f]); }
  // Standard error of a mean square over this many texels, if it equals the tolerance.
  static double error(std::span<const double> noise, double tolerance, size_t texels) {
    double variance = 0, most = 0;
    for (const double n : noise) {
      variance += n * n;
      most = std::max(most, n);
    }
    return std::sqrt((variance + 2 * tolerance * most) / static_cast<double>(texels));
  }

  const size_t count_;
  std::vector<Pairs> functions_;
  std::vector<double> mean_[kReplicates], noise_;  // by function
};

// By chart; empty where one of its texels was not sampled.
std::vector<std::vector<uint32_t>> known_sites(const TexelStatistics& s,
                                               std::span<const uint32_t> chart_of_site, size_t charts) {
  KILN_CHECK(chart_of_site.size() == s.sites);
  std::vector<std::vector<uint32_t>> known(charts);
  std::vector<uint8_t> sampled(charts, 1);
  for (uint32_t site = 0; site < s.sites; ++site) {
    if (chart_of_site[site] == 0) continue;
    const size_t chart = chart_of_site[site] - 1;
    if (s.samples[site] == 0) sampled[chart] = 0;
    if (s.known[site]) known[chart].push_back(site);
  }
  for (size_t chart = 0; chart < charts; ++chart)
    if (!sampled[chart]) known[chart].clear();
  return known;
}

bool is_black(const TexelStatistics& s, std::span<const uint32_t> sites) {
  uint64_t samples = 0;
  for (const uint32_t site : sites) {
    samples += kReplicates * uint64_t{s.samples[site]};
    for (uint32_t r = 0; r < kReplicates; ++r)
      for (size_t p = 0; p < s.planes; ++p)
        if (s.mean[r][site * s.planes + p] != 0) return false;
  }
  return samples >= kMinBlackSamples;
}

ChartLight judge_even(const TexelStatistics& s, std::span<const uint32_t> sites, const EvenRules& rules) {
  constexpr size_t kColours = 4;  // R, G, B, luminance
  double light[kColours];
  for (size_t c = 0; c < kColours; ++c) {
    const Pairs pairs(s, sites, 0, c);
    light[c] = 0.5 * (pairs.mean(0) + pairs.mean(1));
  }
  if (!(light[3] > 0)) return {};
  ChartLight even{kEvenlyLit, {}};
  for (const EvenBand& band : rules.bands)
    for (size_t c = 0; c < kColours; ++c) {
      // In a colour that is weak on this chart the error may be as large as the colour itself.
      const double within = rules.error * std::max(light[c], light[3]) / band.scale;
      const double over_chart = 0.5 * within * within / (rules.z * rules.z);
      const BandTest test(s, sites, band, c);
      const double limit = test.limit(over_chart);
      if (!(limit <= over_chart) || !test.blocks_are_within(within * within)) return {};
      if (c == 3) even.deviation.push_back(static_cast<float>(std::sqrt(limit)));
    }
  return even;
}

}  // namespace

std::vector<EvenBand> even_bands(const BasisInfo& basis) {
  std::vector<EvenBand> bands{{{0}, 1}};
  for (const BasisBand& band : basis_bands(basis)) {
    EvenBand& even = bands.emplace_back();
    for (const size_t f : band.functions) even.first_planes.push_back(3 + 3 * f);
    even.scale = 0;
    for (const size_t f : band.functions) even.scale = std::max(even.scale, largest_irradiance(basis, f));
  }
  return bands;
}

std::vector<ChartLight> judge_charts(const TexelStatistics& s, std::span<const uint32_t> chart_of_site,
                                     size_t charts, const EvenRules& rules) {
  const std::vector<std::vector<uint32_t>> known = known_sites(s, chart_of_site, charts);
  std::vector<ChartLight> out(charts);
  parallel_for(charts, [&](size_t chart) {
    if (known[chart].empty()) return;
    if (is_black(s, known[chart]))
      out[chart].why = kUnlit;
    else if (known[chart].size() >= kMinEven)
      out[chart] = judge_even(s, known[chart], rules);
  });
  return out;
}

std::vector<uint8_t> black_charts(const TexelStatistics& s, std::span<const uint32_t> chart_of_site,
                                  size_t charts) {
  const std::vector<std::vector<uint32_t>> known = known_sites(s, chart_of_site, charts);
  std::vector<uint8_t> out(charts, 0);
  parallel_for(charts, [&](size_t c) { out[c] = !known[c].empty() && is_black(s, known[c]); });
  return out;
}

}  // namespace kiln
