// Diffusion over links: the simplest wide average there is.
#pragma once

#include <vector>

#include "common/base/parallel.h"
#include "coordinator/bake/neighbours/surface_links.h"

namespace kiln {

// Averages over a site and its linked sites, counting the site twice; 0 at unknown sites.
inline void average_linked(const std::vector<float>& in, const std::vector<uint8_t>& known,
                           const SurfaceLinks& links, unsigned threads, std::vector<float>& out) {
  out.assign(in.size(), 0);
  for_each_index(in.size(), threads, [&](size_t i) {
    if (!known[i]) return;
    double sum = 2 * double{in[i]}, weight = 2;
    for (const uint32_t j : links.of(static_cast<uint32_t>(i))) {
      if (!known[j]) continue;
      sum += in[j];
      weight += 1;
    }
    out[i] = static_cast<float>(sum / weight);
  });
}

}  // namespace kiln
