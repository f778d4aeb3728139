#include "coordinator/bake/sampling/cache_draws.h"

#include <algorithm>
#include <cmath>

#include "common/base/parallel.h"
#include "common/math/sequence.h"
#include "coordinator/bake/sampling/alike.h"

namespace kiln {

void add_noise_draws(const CacheNoise& noise, uint32_t seed, IrradianceCache& cache) {
  for_each_index(cache.draws.size(), 0, [&](size_t i) {
    if (noise.cached[i] == 0) return;
    const double variance = double{noise.variance[i]} * kReplicates * noise.measured[i] / noise.cached[i];
    const auto deviation = static_cast<float>(std::sqrt(variance));
    if (!std::isfinite(deviation)) return;
    const uint32_t signs = hash_bits(hash_combine(seed, static_cast<uint32_t>(i)));
    for (uint32_t k = 0; k < kCacheDraws; ++k) {
      const float with = cache.draws[i][k] + (signs >> k & 1 ? deviation : -deviation);
      if (std::isfinite(with)) cache.draws[i].set(k, with);
    }
  });
}

void find_shared(std::span<const uint32_t> chart_of_site, TexelStatistics& s) {
  if (s.drawn[0].empty()) return;
  s.shared.assign(s.sites, 0.0f);
  constexpr size_t kDraws = kReplicates * kCacheDraws;
  // Paths from open ground rarely end at a cache: most of its sites have drawn nothing, and add nothing.
  std::vector<uint8_t> has_drawn(s.sites);
  for_each_index(s.sites, 0, [&](size_t i) {
    for (size_t r = 0; r < kReplicates; ++r) {
      const float* drawn = s.drawn[r].data() + i * kCacheDraws;
      has_drawn[i] |= !std::all_of(drawn, drawn + kCacheDraws, [](float d) { return d == 0; });
    }
  });
  struct Drawn {
    double light = 0, count = 0, sum[kDraws] = {}, square[kDraws] = {};  // by replicate, then draw
    void add(const Drawn& d) {
      light += d.light;
      count += d.count;
      for (size_t k = 0; k < kDraws; ++k) sum[k] += d.sum[k], square[k] += d.square[k];
    }
  };
  const auto add_site = [&](size_t j, Drawn& to) {
    to.light += mean_luminance(s, j);
    to.count += 1;
    if (!has_drawn[j]) return;
    for (size_t r = 0; r < kReplicates; ++r) {
      const float* drawn = s.drawn[r].data() + j * kCacheDraws;
      double *sum = to.sum + r * kCacheDraws, *square = to.square + r * kCacheDraws;
      for (size_t k = 0; k < kCacheDraws; ++k) {
        sum[k] += double{drawn[k]};
        square[k] += double{drawn[k]} * double{drawn[k]};
      }
    }
  };
  const AlikeRuns runs(s, chart_of_site);
  std::vector<Drawn> of_run(runs.count());
  for_each_index(runs.count(), 0, [&](size_t r) {
    for (size_t j = r * kAlikeRun; j < std::min(s.sites, (r + 1) * kAlikeRun); ++j) add_site(j, of_run[r]);
  });
  std::vector<uint32_t> drawn_before(s.sites + 1);
  for (size_t i = 0; i < s.sites; ++i) drawn_before[i + 1] = drawn_before[i] + has_drawn[i];
  for_each_index(s.sites, 0, [&](size_t i) {
    const size_t first = i > kAlikeReach ? i - kAlikeReach : 0, last = std::min(s.sites, i + kAlikeReach + 1);
    if (drawn_before[last] == drawn_before[first]) return;
    Drawn all;
    for_each_alike(
        s, chart_of_site, runs, i, [&](size_t j) { add_site(j, all); },
        [&](size_t r) { all.add(of_run[r]); });
    if (!(all.light > 0)) return;
    double variance = 0;
    for (size_t d = 0; d < kDraws; ++d) {
      // Less the noise of a mean of so many: n s^2 is the sum of squares less that of the mean, over n - 1.
      const double shared = all.sum[d] * all.sum[d];
      variance += all.count > 1 ? all.count * (shared - all.square[d]) / (all.count - 1) : shared;
    }
    // Each replicate's error is a half of the mean's, in light of `count` texels.
    const double relative = variance / kDraws / kReplicates / (all.light * all.light);
    s.shared[i] = static_cast<float>(std::clamp(relative, 0.0, 1.0));
  });
  for (ZeroedVector<float>& drawn : s.drawn) drawn = {};
}

}  // namespace kiln
