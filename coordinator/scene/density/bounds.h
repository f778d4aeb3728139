// World-space bounds of objects.
#pragma once

#include "coordinator/scene/density/wishes.h"

namespace kiln {

struct Bounds {
  DVec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};

  void add(const DVec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  bool touches(const DVec3& other_low, const DVec3& other_high) const {
    for (int k = 0; k < 3; ++k)
      if (!(low[k] <= other_high[k] && high[k] >= other_low[k])) return false;
    return true;
  }
  bool inside(const DVec3& other_low, const DVec3& other_high) const {
    for (int k = 0; k < 3; ++k)
      if (!(low[k] >= other_low[k] && high[k] <= other_high[k])) return false;
    return true;
  }
  double distance(const DVec3& p) const { return length(p - glm::clamp(p, low, high)); }
  double diagonal() const { return length(high - low); }
};

}  // namespace kiln
