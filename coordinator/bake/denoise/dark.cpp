#include "coordinator/bake/denoise/dark.h"

#include <cmath>

#include "common/base/parallel.h"
#include "coordinator/bake/denoise/site_average.h"
#include "coordinator/bake/neighbours/pieces.h"
#include "coordinator/bake/neighbours/surface_window.h"

namespace kiln {
namespace {

constexpr float kDarkShare = 0.02f;  // of the surrounding light
constexpr double kMaxFalse = 0.1;    // largest share of dark texels that chance may explain
constexpr double kPrior = 2;         // prior replicates, from elsewhere, added to a window's counts
constexpr uint32_t kRounds =
    4;  // diffusion steps: a first estimate of the surrounding light, to test few texels
constexpr float kNear = 2.0f, kWide = 6.4f;  // texels: radii of the counting windows

// Counts of a window's texels by the replicates in which they are dark.
struct Counts {
  double lit = 0, half = 0, dark = 0;  // in both, in one of them, in none

  void add(int dark_replicates) { (dark_replicates == 0 ? lit : dark_replicates == 1 ? half : dark) += 1; }

  // Probability that a replicate of a lit texel finds no light by chance. Few texels do not determine it, so
  // kPrior replicates are added, with the dark share `elsewhere`.
  double missed(double elsewhere) const { return (half + kPrior * elsewhere) / (half + 2 * lit + kPrior); }
  // Share of texels dark in both replicates that chance explains.
  double false_share(double elsewhere) const {
    const double missed = this->missed(elsewhere);
    const double by_chance = (lit + half) * missed * missed / (1 - missed * missed);
    return dark > 0 ? by_chance / dark : 1;
  }
};

class DarkTexels {
 public:
  DarkTexels(const TexelStatistics& s, const SiteGeometry& sites, const SurfaceLinks& links, unsigned threads)
      : s_(s), sites_(sites), links_(links), threads_(threads), light_(s.sites, 0), known_(s.sites) {
    for_each_index(s.sites, threads, [&](size_t i) {
      known_[i] = s.known[i] && s.samples[i] > 0 && sites.texel_size[i] > 0 &&
                  std::isfinite(s.luminance[0][i]) && std::isfinite(s.luminance[1][i]);
      if (known_[i]) light_[i] = 0.5f * (std::abs(s.luminance[0][i]) + std::abs(s.luminance[1][i]));
    });
  }

  // [site] 1: truly dark.
  std::vector<uint8_t> find() {
    std::vector<float> around = light_, next;
    for (uint32_t round = 0; round < kRounds; ++round) {
      average_linked(around, known_, links_, threads_, next);
      around.swap(next);
    }
    count_pieces(around);
    std::vector<uint8_t> out(s_.sites);
    for_each_run(s_.sites, threads_, [&](size_t begin, size_t end) {
      SurfaceWindow window(sites_, links_);
      for (size_t i = begin; i < end; ++i)
        if (known_[i] && both_below(i, kDarkShare * around[i]))
          out[i] = is_dark(static_cast<uint32_t>(i), window);
    });
    return out;
  }

 private:
  // A small piece has too few texels to count: all small ones are counted together.
  static constexpr uint32_t kSmallPiece = 64;

  void count_pieces(const std::vector<float>& around) {
    group_ = surface_pieces(known_, links_);
    const std::vector<uint32_t> size = piece_sizes(group_);
    std::vector<uint32_t> number(s_.sites, 0);
    uint32_t large = 0;
    for (size_t p = 0; p < s_.sites; ++p)
      if (size[p] >= kSmallPiece) number[p] = ++large;
    std::vector<Counts> counts(size_t{large} + 1);
    for (size_t i = 0; i < s_.sites; ++i) {
      group_[i] = number[group_[i]];
      if (!known_[i] || !(around[i] > 0)) continue;
      const float threshold = kDarkShare * around[i];
      counts[group_[i]].add(below(0, i, threshold) + below(1, i, threshold));
    }
    for (const Counts& of : counts) missed_.push_back(of.missed(0.5));
  }

  bool below(int replicate, size_t i, float light) const {
    return std::abs(s_.luminance[replicate][i]) <= light;
  }
  bool both_below(size_t i, float light) const {
    return light > 0 && below(0, i, light) && below(1, i, light);
  }

  bool is_dark(uint32_t site, SurfaceWindow& window) const {
    return false_share(site, kNear, window) <= kMaxFalse && false_share(site, kWide, window) <= kMaxFalse;
  }

  double false_share(uint32_t site, float texels, SurfaceWindow& window) const {
    const std::span<const uint32_t> around = window.around(site, texels * sites_.texel_size[site]);
    double light = 0;
    size_t count = 0;
    for (const uint32_t j : around)
      if (known_[j]) light += light_[j], ++count;
    const auto threshold = static_cast<float>(kDarkShare * light / static_cast<double>(count));
    if (!both_below(site, threshold)) return 1;
    Counts counts;
    for (const uint32_t j : around) {
      // With more samples, dark by chance is rarer: they are no evidence for this texel.
      if (!known_[j] || s_.samples[j] > 2 * s_.samples[site]) continue;
      counts.add(below(0, j, threshold) + below(1, j, threshold));
    }
    return counts.false_share(missed_[group_[site]]);
  }

  const TexelStatistics& s_;
  const SiteGeometry& sites_;
  const SurfaceLinks& links_;
  unsigned threads_;
  std::vector<float> light_;
  std::vector<uint8_t> known_;
  std::vector<uint32_t> group_;  // by site: 0 on small pieces, else the number of its piece
  std::vector<double> missed_;   // by group
};

}  // namespace

SurfaceLinks part_dark(const TexelStatistics& statistics, const SiteGeometry& sites,
                       const SurfaceLinks& links, unsigned threads) {
  const std::vector<uint8_t> dark = DarkTexels(statistics, sites, links, threads).find();
  SurfaceLinks out;
  out.first.assign(links.first.size(), 0);
  out.link.reserve(links.link.size());
  for (uint32_t i = 0; i < statistics.sites; ++i) {
    for (const uint32_t j : links.of(i))
      if (dark[i] == dark[j]) out.link.push_back(j);
    out.first[i + 1] = static_cast<uint32_t>(out.link.size());
  }
  return out;
}

}  // namespace kiln
