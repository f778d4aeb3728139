// Texels that hold light of both sides of a wall that stands on them.
#pragma once

#include <vector>

#include "common/atlas/atlas.h"

namespace kiln {

// By site: 1 where a line of atlas.contacts runs between the texel's own surface points. Charts that layout
// pack cut have none but where contacts were too many; charts of the file may have many. Empty without
// contacts.
std::vector<uint8_t> straddling_sites(const Scene& scene, const Atlas& atlas);

}  // namespace kiln
