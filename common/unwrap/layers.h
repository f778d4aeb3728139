// The cheap fallback for surfaces that the solver cannot flatten or may not spend time on.
#pragma once

#include "common/unwrap/flatten.h"

namespace kiln {

// Faces sorted by the dominant axis of their normals (six directions, stretch at most sqrt(3)), projected
// along it, and distributed over layers without overlaps, decided exactly. Faces of a layer need not be
// connected. Faces that fit none of 64 layers, or that pile up in one place, become charts of their own.
// Never fails.
std::vector<FlatChart> layered_charts(const Surface& surface, const std::vector<uint32_t>& faces);

}  // namespace kiln
