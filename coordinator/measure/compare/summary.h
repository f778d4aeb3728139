// A comparison as text, JSON and CSV.
#pragma once

#include <string>

#include "common/base/json.h"
#include "coordinator/measure/compare/measures.h"

namespace kiln {

std::string comparison_text(const Comparison& c, const CompareSettings& settings);
std::string comparison_json(const Comparison& c, const CompareSettings& settings);
// A line of names and a line of values; unknown values are empty.
std::string comparison_csv(const Comparison& c);

}  // namespace kiln
