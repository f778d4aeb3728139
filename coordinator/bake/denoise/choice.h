// Which filter each site gets, by an unbiased estimate of the error of each.
#pragma once

#include <array>

#include "coordinator/bake/denoise/candidates.h"

namespace kiln {

struct Choice {
  std::vector<uint8_t> level;  // by site: of the least estimated risk
  std::vector<float> factor;   // by site: variance of what was measured around it, over `prior`
  std::vector<std::array<float, kLevels>> bias;  // by site: estimated size of the bias, not less than 0
  std::vector<float>
      shared;  // by site: variance of what is wrong of all around alike, which no filter lowers
};

Choice choose(const Candidates& candidates, const SiteGeometry& sites, const SurfaceLinks& links,
              unsigned threads);

}  // namespace kiln
