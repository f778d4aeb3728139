// Which object a texel is of.
#pragma once

#include <filesystem>
#include <span>

#include "coordinator/measure/compare/measures.h"

namespace kiln {

// Names the objects of the texels by the boxes of charts in charts.json of the bake's folder; the smallest
// box around the texel counts, as charts may lie in each other's gaps. Leaves the names empty where there is
// no such file or none that can be read: they are a help for a person and decide nothing.
void name_places(const std::filesystem::path& folder, std::span<WorstTexel> texels);

}  // namespace kiln
