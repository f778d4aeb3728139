#include "coordinator/run/skipped.h"

#include "common/base/format.h"

namespace kiln {

void SkippedSites::add(const WorkUnit& unit, const std::string& reason) {
  ++units_;
  reason_ = reason;
  sites_.insert(unit.sites.begin(), unit.sites.end());
}

void SkippedSites::clear() {
  sites_.clear();
  units_ = 0;
}

void SkippedSites::leave_out_of(std::vector<SiteSamples>& work) const {
  std::erase_if(work, [&](const SiteSamples& s) { return contains(s.site); });
}

std::string SkippedSites::sentence() const {
  if (sites_.empty()) return "";
  return text(
      "{} units failed on every worker that tried them and were left out; their {} texels have fewer "
      "samples or none: {}",
      units_, sites_.size(), reason_);
}

}  // namespace kiln
