// What a result must be before anybody looks at its numbers.
#pragma once

#include "common/wire/messages.h"

namespace kiln {

// `site_count`: of the unit, 0 if it is of an earlier pass and no longer known. Errors say what is wrong.
Status check_result(const Result& result, uint32_t site_count, uint32_t plane_count);

}  // namespace kiln
