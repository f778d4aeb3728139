// What is reported of the error of a response.
#pragma once

#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/sampling/texel_errors.h"

namespace kiln {

// Standard error of what entry `response` of the layout's responses stores, by site, as estimate_errors()
// does for light; absolute: `mean` is 1 where the texel is known.
TexelErrors response_errors(const Accumulator& sums, size_t response, std::span<const uint32_t> charts);

}  // namespace kiln
