// Sites that err by what they read from the irradiance caches take their samples again before most samples
// are given out (docs/samples.md, "Settling"). Samples of their own hardly lower that error, and the
// allocation, which takes all of a site's error for that of its samples, would give them nearly all there
// are.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "coordinator/bake/sampling/schedule.h"

namespace kiln {

// Share of the relative standard error at the end of the bake that may come by way of the caches of now.
constexpr double kSettledPart = 0.2;
// A cache that leaves more of the squared error than this is no help; the next one is made of twice the
// samples.
constexpr double kSettlingHelps = 0.85;
// Shares of the samples to come that one round, and all of them, may take.
constexpr double kSettlingRound = 0.1, kSettlingShare = 0.25;

struct SettlingState {
  std::span<const float> shared;      // by site: TexelStatistics::shared; empty without caches
  std::span<const uint32_t> samples;  // by site, per replicate
  uint32_t most = 0;                  // samples of a site, per replicate
  double error = 0;                   // relative standard error of a site at the end of the bake
  double to_come = 0;                 // samples of all later passes, over sites and replicates
};

class Settling {
 public:
  // The sites whose samples are to be dropped and taken again, by caches made of what they have now. None if
  // what they share is as little in the mean over all sites, since a round of a few sites takes as long as
  // one of a map's tenth; or if they would take too large a share of the samples to come.
  std::vector<SiteSamples> next(const SettlingState& state);

 private:
  double before_ = std::numeric_limits<double>::infinity();  // squared error, summed over these sites
  double taken_ = 0;
};

}  // namespace kiln
