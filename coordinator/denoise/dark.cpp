#include "coordinator/denoise/dark.h"

#include <cmath>

#include "common/base/parallel.h"
#include "coordinator/denoise/site_average.h"
#include "coordinator/neighbours/pieces.h"
#include "coordinator/neighbours/surface_window.h"

namespace kiln {
namespace {

constexpr float kDarkShare = 0.02f;  // of the light around
constexpr double kMostFalse = 0.1;   // of those called dark, share that chance has made
constexpr double kPrior = 2;         // replicates of elsewhere that are added to what a window counts
constexpr uint32_t kRounds = 4;      // of diffusion: a first idea of the light around, to ask few texels
constexpr float kNear = 2.0f, kWide = 6.4f;  // texels: windows that are counted

// What both replicates say of the texels of a window.
struct Counts {
  double lit = 0, half = 0, dark = 0;  // in both, in one of them, in none

  // Of all samples of a lit texel's replicate none has met light. Of few texels nobody knows that chance
  // never does it: they are added to kPrior replicates of which the share `elsewhere` missed it.
  double missed(double elsewhere) const { return (half + kPrior * elsewhere) / (half + 2 * lit + kPrior); }
  // Of those dark in both, how many chance has made.
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

  // [site] 1: dark in truth.
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
  // Of a small piece there is little to count: all of them together.
  static constexpr uint32_t kSmallPiece = 64;

  void count_pieces(const std::vector<float>& around) {
    piece_ = surface_pieces(known_, links_);
    std::vector<uint32_t> size(s_.sites);
    for (const uint32_t p : piece_) ++size[p];
    std::vector<Counts> counts(s_.sites);
    Counts small;
    for (size_t i = 0; i < s_.sites; ++i) {
      if (!known_[i] || !(around[i] > 0)) continue;
      const float threshold = kDarkShare * around[i];
      const int dark = below(0, i, threshold) + below(1, i, threshold);
      Counts& of = size[piece_[i]] < kSmallPiece ? small : counts[piece_[i]];
      (dark == 0 ? of.lit : dark == 1 ? of.half : of.dark) += 1;
    }
    missed_.resize(s_.sites);
    for (size_t p = 0; p < s_.sites; ++p)
      missed_[p] = static_cast<float>((size[p] < kSmallPiece ? small : counts[p]).missed(0.5));
  }

  bool below(int replicate, size_t i, float light) const {
    return std::abs(s_.luminance[replicate][i]) <= light;
  }
  bool both_below(size_t i, float light) const {
    return light > 0 && below(0, i, light) && below(1, i, light);
  }

  bool is_dark(uint32_t site, SurfaceWindow& window) const {
    return false_share(site, kNear, window) <= kMostFalse && false_share(site, kWide, window) <= kMostFalse;
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
      // Of more samples fewer are dark by chance: they do not speak for this texel.
      if (!known_[j] || s_.samples[j] > 2 * s_.samples[site]) continue;
      const int dark = below(0, j, threshold) + below(1, j, threshold);
      (dark == 0 ? counts.lit : dark == 1 ? counts.half : counts.dark) += 1;
    }
    return counts.false_share(missed_[piece_[site]]);
  }

  const TexelStatistics& s_;
  const SiteGeometry& sites_;
  const SurfaceLinks& links_;
  unsigned threads_;
  std::vector<float> light_;
  std::vector<uint8_t> known_;
  std::vector<uint32_t> piece_;
  std::vector<float> missed_;  // by piece
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
