#include "coordinator/bake/denoise/spikes.h"

#include <cmath>

#include "coordinator/bake/denoise/site_average.h"

namespace kiln {
namespace {

constexpr uint32_t kRounds = 16;  // averaging steps: a spread of three texels, as the widest filter

// A texel of one replicate that is this many times brighter than the other replicate around it shifts the
// result of the widest filter (about 160 values) by a quarter. With more samples filters are narrower and
// such outliers rarer.
constexpr double kStandsOut = 40, kMinStandsOut = 8;
// It is real light, not an outlier, if the other replicate or two adjacent texels are as bright up to this
// factor.
constexpr float kAlike = 0.25f;
// Spikes that hold more than this share of a piece's light are its light.
constexpr double kMaxShare = 0.5;

struct Piece {
  int64_t base = 0, excess = 0, squares = 0;  // in units that make sums exact
};

bool is_alone(const TexelStatistics& s, const std::vector<uint8_t>& known, const SurfaceLinks& links,
              size_t i, uint32_t replicate) {
  const float alike = kAlike * s.luminance[replicate][i];
  if (s.luminance[1 - replicate][i] >= alike) return false;
  int beside = 0;
  for (const uint32_t j : links.of(static_cast<uint32_t>(i)))
    beside += known[j] && std::max(s.luminance[0][j], s.luminance[1][j]) >= alike;
  return beside <= 1;
}

}  // namespace

Spikes find_spikes(const TexelStatistics& s, const std::vector<uint8_t>& known,
                   const std::vector<uint32_t>& pieces, const SurfaceLinks& links, unsigned threads) {
  Spikes out;
  std::vector<float> level[kReplicates], next;
  float largest = 0;
  for (uint32_t r = 0; r < kReplicates; ++r) {
    out.keep[r].assign(s.sites, 1.0f);
    level[r] = s.luminance[r];
    for (size_t i = 0; i < s.sites; ++i) {
      if (!known[i]) level[r][i] = 0;
      largest = std::max(largest, level[r][i]);
    }
    for (uint32_t round = 0; round < kRounds; ++round) {
      average_linked(level[r], known, links, threads, next);
      level[r].swap(next);
    }
  }
  out.gain.assign(s.sites, 1.0f);
  out.relative_error.assign(s.sites, 0.0f);
  if (!(largest > 0)) return out;
  const double unit = std::ldexp(1.0, 30 - std::ilogb(largest));
  std::vector<Piece> sums(s.sites);
  for (size_t i = 0; i < s.sites; ++i) {
    if (!known[i]) continue;
    const double times = std::max(kMinStandsOut, kStandsOut / std::sqrt(static_cast<double>(s.samples[i])));
    Piece& sum = sums[pieces[i]];
    for (uint32_t r = 0; r < kReplicates; ++r) {
      const double value = s.luminance[r][i], around = level[1 - r][i];
      double excess = 0;
      if (value > times * around && around > 0 && is_alone(s, known, links, i, r)) {
        out.keep[r][i] = static_cast<float>(around / value);
        excess = value - around;
      }
      sum.base += std::llround((value - excess) * unit);
      sum.excess += std::llround(excess * unit);
      const double share = excess / largest;
      sum.squares += std::llround(std::ldexp(share * share, 30));
    }
  }
  for (size_t i = 0; i < s.sites; ++i) {
    if (!known[i]) continue;
    const Piece& sum = sums[pieces[i]];
    if (sum.excess == 0) continue;
    const double base = static_cast<double>(sum.base), excess = static_cast<double>(sum.excess);
    if (excess > kMaxShare * base) {
      for (std::vector<float>& keep : out.keep) keep[i] = 1;
      continue;
    }
    out.gain[i] = static_cast<float>(1 + excess / base);
    const double square = std::ldexp(static_cast<double>(sum.squares), -30);
    out.relative_error[i] = static_cast<float>(std::sqrt(square) * largest * unit / base);
  }
  return out;
}

}  // namespace kiln
