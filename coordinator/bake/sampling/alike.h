// Texels that share an error in proportion to their light: those of a chart with about as much of it.
#pragma once

#include <algorithm>
#include <span>

#include "coordinator/bake/lightmap/as_bright.h"
#include "coordinator/bake/lightmap/texel_statistics.h"

namespace kiln {

constexpr size_t kAlikeReach = 64;  // sites in Morton order, on either side

// Visits site i and the known sites alike. None if site i has no light.
template <class Visit>
void for_each_alike(const TexelStatistics& s, std::span<const uint32_t> chart_of_site, size_t i,
                    const Visit& visit) {
  const auto square_of_error = [&](size_t j) { return double{s.variance[j]} / (kReplicates * s.samples[j]); };
  if (!s.known[i] || !(mean_luminance(s, i) > 0)) return;
  const double own = mean_luminance(s, i), error = square_of_error(i);
  const size_t last = std::min(s.sites, i + kAlikeReach + 1);
  for (size_t j = i > kAlikeReach ? i - kAlikeReach : 0; j < last; ++j) {
    if (!s.known[j] || chart_of_site[j] != chart_of_site[i]) continue;
    const double light = mean_luminance(s, j);
    // Most are, whatever their errors.
    if (is_as_bright(own, light, 0) || is_as_bright(own, light, std::max(error, square_of_error(j))))
      visit(j);
  }
}

}  // namespace kiln
