// Sums of all texels, merged in sample order whatever the order of arrival, and what they resolve to.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/job/unit.h"
#include "coordinator/lightmap/lightmap.h"

namespace kiln {

class Accumulator {
 public:
  Accumulator(size_t sites, uint32_t basis);

  // Adds a unit's sums. A unit whose earlier range of the same sites is still missing waits for it.
  Status add(const WorkUnit& unit, const UnitResult& result);

  uint32_t samples(uint32_t site) const { return samples_[site]; }
  struct Estimate {
    double mean = 0, standard_error = 0;  // luminance of E
    bool inside = false;                  // more than half of the primary rays met back faces
    bool pushed = false;                  // more than half of the samples were taken from a moved place
  };
  // Stated standard error: sqrt(variance / n) of the samples, which for a stratified sequence is an upper
  // estimate, plus 2^-20 of the mean for the rounding of float paths. n < 2: infinite.
  Estimate estimate(uint32_t site) const;

  // True if the texel needs no more samples: its confidence interval z x SEM is within `error` of the mean
  // (O'Donnell 2018, "Convergence detection"), or it lies inside geometry.
  bool converged(uint32_t site, double error, double z) const;

  void clear();  // as new

  // Means of everything, by texel.
  Lightmap resolve(const Atlas& atlas) const;

 private:
  void add_in_order(const WorkUnit& unit, const std::vector<double>& moments);
  uint32_t basis_;
  size_t planes_;
  std::vector<uint32_t> samples_;  // by site
  std::vector<double> sums_;       // [site][plane]
  struct Waiting {
    WorkUnit unit;
    std::vector<double> moments;
  };
  std::map<std::pair<uint32_t, uint32_t>, Waiting> waiting_;  // by first site and first sample
};

}  // namespace kiln
