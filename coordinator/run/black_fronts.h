// Double-sided walls whose normals point out of the room that they enclose.
#pragma once

#include <string>

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln {

// A warning about charts with double-sided materials that met no light on their fronts although their backs
// face lit surfaces or the sky: a lightmap holds the light of fronts, and a renderer shows it on the backs
// too, which are black then. Empty: none. `map`: as measured.
std::string warn_of_black_fronts(const Scene& scene, const Atlas& atlas, const Lightmap& map);

}  // namespace kiln
