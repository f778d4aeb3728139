// Sites whose error comes from the irradiance caches drop their samples and take them again before the large
// passes (docs/samples.md, "Settling"). More samples of their own hardly lower that error, and the
// allocation, which sees one error for each site, would give them nearly all samples.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "coordinator/bake/sampling/schedule.h"

namespace kiln {

// A site has settled if the error it has from the caches is this part of the error at the end of the bake.
constexpr double kSettledPart = 0.2;
// A new cache that leaves more than this of the squared error did not help; the next one gets twice the
// samples.
constexpr double kSettlingHelps = 0.85;
// Shares of the samples to come that one round, and all of them, may take.
constexpr double kSettlingRound = 0.03, kSettlingShare = 0.1;

// Where no cache helps and no more than this share of the sites is left, what they read is mostly their own:
// a nearly closed cavity hands on all of the error that its first cache had.
constexpr double kLeftOut = 0.02;

struct SettlingState {
  std::span<const float> shared;      // by site: TexelStatistics::shared; empty without caches
  std::span<const uint32_t> samples;  // by site, per replicate
  uint32_t most = 0;                  // samples of a site, per replicate
  double error = 0;                   // relative standard error of a site at the end of the bake
  double to_come = 0;                 // samples of all later passes, over sites and replicates
  // By site, and the least mean that counts in the norm (least_mean()): the error of a darker site counts as
  // far as it does there. Empty: every site counts in full.
  std::span<const float> mean = {};
  double floor = 0;
};

// Share of the sampled sites that have not settled; 0 without caches.
double unsettled_share(const SettlingState& state);

class Settling {
 public:
  // The sites that drop their samples and take them again, with caches made of what they have now. None if
  // what these sites share is small in the mean over all sites (a round of a few sites takes long for what it
  // brings), or if the round would take too large a share of the samples to come.
  std::vector<SiteSamples> next(const SettlingState& state);
  // Of these, the sites to leave out of the caches from now on, so that paths go on there. They do not come
  // again.
  const std::vector<uint32_t>& left_out() const { return left_out_; }

 private:
  double before_ = std::numeric_limits<double>::infinity();  // squared error, summed over these sites
  double taken_ = 0;
  std::vector<uint32_t> left_out_;  // by the last call
  std::vector<uint8_t> is_out_;     // by site
};

}  // namespace kiln
