// The reported error of responses.
#pragma once

#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/sampling/texel_errors.h"

namespace kiln {

// For every response of the layout, the standard error of its stored value by site, estimated like light's
// (estimate_errors); absolute, `mean` 1 where the texel is known. Samples that all agree have no variance but
// prove little: if none of N rays around a texel escaped, the next one may. So a sample's variance is at
// least 1 / (N + 1), that of a rate of one in N + 1 (Laplace's rule of succession).
std::vector<TexelErrors> response_errors(const Accumulator& sums, std::span<const uint32_t> charts);

}  // namespace kiln
