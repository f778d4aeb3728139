// Collects samples with radiance beyond float range from the results of units.
#pragma once

#include "common/atlas/atlas.h"
#include "common/job/unit.h"
#include "coordinator/report/report.h"

namespace kiln {

class NonfiniteLog {
 public:
  // Both must outlive the log.
  NonfiniteLog(const Atlas& atlas, const Scene& scene) : atlas_(atlas), scene_(scene) {}
  void add(const WorkUnit& unit, const UnitResult& result);
  void clear() { count_ = 0, places_.clear(); }
  // By texel, then sample, independent of arrival order; the first kMax of them.
  const std::vector<NonfinitePlace>& places() const { return places_; }
  // One sentence for the user; empty if all samples were finite.
  std::string sentence() const;

 private:
  static constexpr size_t kMax = 16;
  const Atlas& atlas_;
  const Scene& scene_;
  uint64_t count_ = 0;
  std::vector<NonfinitePlace> places_;
};

}  // namespace kiln
