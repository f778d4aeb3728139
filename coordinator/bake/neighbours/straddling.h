// Texels that hold light of both sides of a wall that stands on them.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

// By site: 1 where a line of atlas.contacts runs between the texel's own surface points. Empty without
// contacts, and for layout pack, whose charts end at them.
std::vector<uint8_t> straddling_sites(const Scene& scene, const Atlas& atlas);

}  // namespace kiln
