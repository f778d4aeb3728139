// Which filter each site gets, by an unbiased estimate of the error of each.
#pragma once

#include <array>

#include "coordinator/denoise/candidates.h"

namespace kiln {

struct Choice {
  std::vector<uint8_t> level;                    // by site: of the least estimated risk
  std::vector<std::array<float, kLevels>> risk;  // by site: estimated mean squared error, scale^2; that of
                                                 // level 0 is the variance of what was measured
};

Choice choose(const Candidates& candidates, const SiteGeometry& sites, const SurfaceLinks& links,
              unsigned threads);

}  // namespace kiln
