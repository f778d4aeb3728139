// What packers are measured against.
#pragma once

#include "common/pack/pack.h"

namespace kiln::bench {

// Every item, largest first, goes to the first place in row order: from row 0, position by position, not
// turned.
PackResult plain_sweep(const MaskSet& masks, uint32_t width);

}  // namespace kiln::bench
