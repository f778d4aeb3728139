// Selects a filter per site by an unbiased estimate of each filter's error.
#pragma once

#include <array>

#include "coordinator/bake/denoise/candidates.h"

namespace kiln {

struct Choice {
  std::vector<uint8_t> level;        // by site: level with the lowest estimated risk
  std::vector<float> factor;         // by site: measured variance around it, over `prior`; for the choice
  std::vector<float> stated_factor;  // the same for what is stated
  std::vector<std::array<float, kLevels>> bias;  // by site: estimated magnitude of the bias, at least 0
  // By site, over the square of the light: variance of error common to the whole neighbourhood, which no
  // filter lowers, and the part of it that is in the replicates' difference, and in the factors with it.
  std::vector<float> shared, found;
};

Choice choose(const Candidates& candidates, const SiteGeometry& sites, const SurfaceLinks& links,
              unsigned threads, WindowTables tables = {});

}  // namespace kiln
