// The object that a texel belongs to.
#pragma once

#include <filesystem>
#include <span>

#include "coordinator/measure/compare/measures.h"

namespace kiln {

// Names the objects of the texels by the chart boxes in charts.json of the bake's folder; the
// smallest box around the texel counts, since charts may lie in each other's gaps. Leaves the names
// empty if the file does not exist or cannot be read: they only help people and decide nothing.
void name_places(const std::filesystem::path& folder, std::span<WorstTexel> texels);

}  // namespace kiln
