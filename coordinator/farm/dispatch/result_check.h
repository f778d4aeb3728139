// Sanity checks on a result before its numbers are used.
#pragma once

#include "common/wire/messages.h"

namespace kiln {

// `unit`: null if it belongs to an earlier pass and is no longer known. Detects impossible values: non-finite
// numbers, counts beyond the samples, negative luminances (but of units that read a cache) and visibilities.
// Only a second worker can confirm that possible values are right.
Status check_result(const Result& result, const WorkUnit* unit, const MomentLayout& layout);

}  // namespace kiln
