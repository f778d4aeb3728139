// In which order the texels of a bake whose time is limited get their first sample: whole before fine.
#pragma once

#include <cstdint>
#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

// Sites by look, ascending in each: one texel of 8 x 8 and at least one of every chart; one of 4 x 4; one of
// 2 x 2; the rest. A fixed pattern of places in the atlas, so that it depends on nothing but the atlas.
std::vector<std::vector<uint32_t>> sites_by_look(const Atlas& atlas);

}  // namespace kiln
