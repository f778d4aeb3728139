#include "coordinator/bake/denoise/sums.h"

#include <algorithm>
#include <cmath>

#include "coordinator/bake/neighbours/pieces.h"

namespace kiln {
namespace {

constexpr uint32_t kMinSites = 64;  // the sum over fewer errs about as much as one filtered texel
constexpr double kMostChange = 0.25;

struct Sum {
  double missing = 0, filtered = 0;  // filtered: weighted by strength
  uint32_t sites = 0;
};

}  // namespace

void restore_sums(const TexelStatistics& s, const SurfaceLinks& links, Denoised& denoised) {
  std::vector<uint8_t> known(s.sites);
  for (size_t i = 0; i < s.sites; ++i)
    known[i] = s.known[i] && s.samples[i] > 0 && std::isfinite(mean_luminance(s, i));
  const std::vector<uint32_t> piece = surface_pieces(known, links);
  std::vector<Sum> sums(s.sites);
  for (size_t i = 0; i < s.sites; ++i) {
    if (!known[i]) continue;
    Sum& sum = sums[piece[i]];
    sum.missing += mean_luminance(s, i) - denoised.luminance[i];
    sum.filtered += double{denoised.strength[i]} * denoised.luminance[i];
    ++sum.sites;
  }
  for (size_t i = 0; i < s.sites; ++i) {
    if (!known[i]) continue;
    const Sum& sum = sums[piece[i]];
    if (sum.sites < kMinSites || !(sum.filtered > 0)) continue;
    const double change = std::clamp(sum.missing / sum.filtered, -kMostChange, kMostChange);
    const auto factor = static_cast<float>(1 + change * denoised.strength[i]);
    denoised.luminance[i] *= factor;
    denoised.standard_error[i] *= factor;
    if (denoised.mean.empty()) continue;
    for (size_t p = i * s.planes; p < (i + 1) * s.planes; ++p) denoised.mean[p] *= factor;
  }
}

}  // namespace kiln
