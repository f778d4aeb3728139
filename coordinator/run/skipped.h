// The sites of units that failed permanently: they get no more samples.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "common/job/unit.h"
#include "coordinator/bake/sampling/schedule.h"

namespace kiln {

class SkippedSites {
 public:
  void add(const WorkUnit& unit, const std::string& reason);
  void clear();
  bool contains(uint32_t site) const { return sites_.count(site) > 0; }
  void leave_out_of(std::vector<SiteSamples>& work) const;
  // One sentence for the user; empty if none failed.
  std::string sentence() const;

 private:
  std::set<uint32_t> sites_;
  uint64_t units_ = 0;
  std::string reason_;  // of the last unit
};

}  // namespace kiln
