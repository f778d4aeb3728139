// Sums of all texels by replicate, merged in sample order whatever the order of arrival, and
// resolved to means and errors.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <tuple>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/base/zeroed.h"
#include "common/job/irradiance_cache.h"
#include "common/job/unit.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/bake/lightmap/texel_statistics.h"

namespace kiln {

class Accumulator {
 public:
  Accumulator(size_t sites, const MomentLayout& layout);

  // Adds a unit's sums. A unit is held back until the earlier range of the same sites has arrived.
  Status add(const WorkUnit& unit, const UnitResult& result);

  size_t sites() const { return samples_[0].size(); }
  uint32_t samples(uint32_t site) const {
    return samples_[0][site] + samples_[1][site];
  }  // both replicates together
  uint32_t samples(uint32_t site, uint32_t replicate) const { return samples_[replicate][site]; }
  // `plane` is none of the draws.
  double sum(uint32_t site, size_t plane, uint32_t replicate) const {
    return sums_[replicate][site * kept_ + kept(plane)];
  }
  // By site, per replicate; both have equal counts.
  std::vector<uint32_t> replicate_samples() const;
  struct Estimate {
    double mean = 0, standard_error = 0;  // luminance of E
    bool inside = false;                  // more than half of the primary rays met back faces
    bool pushed = false;                  // more than half of the samples were taken from a moved place
  };
  // Estimate from one texel alone: sqrt(variance / n) as if its samples were independent, an upper
  // estimate for a stratified sequence, plus 2^-20 of the mean for the rounding of float paths.
  // Infinite if n < 2. The error that a bake reports is computed in coordinator/bake/sampling.
  Estimate estimate(uint32_t site) const;

  // `planes`: include the means of all planes; without them the size does not depend on the basis. `draws`:
  // include the errors drawn of caches, if there are any.
  TexelStatistics statistics(bool planes = true, bool draws = true) const;
  // The same for one component of entry `response` of the layout's responses instead of luminance; no planes.
  TexelStatistics statistics_of(size_t response, size_t component) const;
  const MomentLayout& layout() const { return layout_; }
  // Irradiance for the paths of the next passes to read: means of one replicate. Where cache errors are drawn
  // (Quantities::cache_draws) they are of each site's latest samples, those since the last renew() before
  // them, with what they inherited as draws: earlier samples came by an earlier cache, whose error a room
  // that reflects its own light would hand on for long (docs/samples.md, "The irradiance cache").
  IrradianceCache cache(uint32_t replicate) const;
  // Samples behind its values, by site; only where cache errors are drawn.
  std::vector<uint32_t> cache_samples(uint32_t replicate) const;
  void renew() { ++generation_; }  // the caches were taken

  void clear();                                 // back to the initial state
  void clear(std::span<const uint32_t> sites);  // of these sites; none of their sums may be held back

  // Means of all planes, by texel.
  Lightmap resolve(const Atlas& atlas) const;

 private:
  void add_in_order(const WorkUnit& unit, const std::vector<double>& moments);
  void add_for_caches(uint32_t replicate, uint32_t site, uint32_t samples, const double* moments);
  double sum(uint32_t site, size_t plane) const { return sum(site, plane, 0) + sum(site, plane, 1); }
  // Index within a site's sums of a plane of the layout that is none of the draws.
  size_t kept(size_t plane) const { return plane < draws_ ? plane : plane - kCacheDraws; }
  void forget_draws(uint32_t replicate, uint32_t site);  // and latest samples
  bool has(uint8_t what, uint32_t replicate, size_t site) const {
    return !has_[replicate].empty() && (has_[replicate][site] & what);
  }
  size_t cached_planes() const;  // the first of the three that caches are made of
  void resolve_responses(const Atlas& atlas, Lightmap& map) const;
  TexelStatistics statistics_of_planes(size_t first, size_t second) const;
  MomentLayout layout_;
  size_t planes_;                               // of results
  size_t kept_;                                 // of sums_: all but the draws
  size_t draws_;                                // the first draw of a result; planes_ if there are none
  std::vector<uint32_t> samples_[kReplicates];  // by site
  ZeroedVector<double> sums_[kReplicates];      // [site][kept_]
  // Only where cache errors are drawn. Most texels of open ground have neither draws nor latest samples that
  // are not all of their samples: pages of these are never touched.
  struct Latest {
    double light[3];  // sums of R G B
    float drawn[kCacheDraws];
    uint32_t samples, generation;
  };
  static constexpr uint8_t kDrawn = 1, kLatest = 2;
  std::vector<uint8_t> has_[kReplicates];           // by site: which of the next two it has
  ZeroedVector<double> drawn_[kReplicates];         // [site][kCacheDraws]
  ZeroedVector<Latest> latest_[kReplicates];        // by site with samples of more than one generation
  std::vector<uint32_t> generations_[kReplicates];  // by site: that of its first samples
  uint32_t generation_ = 0;
  struct Waiting {
    WorkUnit unit;
    std::vector<double> moments;
  };
  std::map<std::tuple<uint32_t, uint32_t, uint32_t>, Waiting>
      waiting_;  // by replicate, first site, first sample
};

}  // namespace kiln
