// Maps settings' words to encoder options.
#pragma once

#include <algorithm>
#include <string>

#include "coordinator/output/blocks/blocks.h"

namespace kiln {

constexpr std::string_view kEfforts[] = {"fast", "normal", "best"};

inline BlockEffort effort_of(const std::string& name) {
  return static_cast<BlockEffort>(std::find(std::begin(kEfforts), std::end(kEfforts), name) -
                                  std::begin(kEfforts));
}

inline BlockMetric metric_of(const std::string& name) {
  return name == "linear" ? BlockMetric::kLinear
         : name == "log"  ? BlockMetric::kLog
                          : BlockMetric::kPerceptual;
}

}  // namespace kiln
