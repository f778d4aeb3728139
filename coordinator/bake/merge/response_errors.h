// The reported error of responses.
#pragma once

#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/sampling/texel_errors.h"

namespace kiln {

// For every response of the layout, the standard error of its stored value by site, estimated as that of
// light (estimate_errors); absolute, with `mean` 1 where the texel is known. Samples that all agree have no
// variance and prove little: where no ray of N around a texel escaped, the next one may. So the variance of a
// sample is at least 1 / (N + 1), that of a rate of one in N + 1 (Laplace's rule of succession).
std::vector<TexelErrors> response_errors(const Accumulator& sums, std::span<const uint32_t> charts);

}  // namespace kiln
