// The cheap way to charts, for what the solver cannot or may not do.
#pragma once

#include "common/unwrap/flatten.h"

namespace kiln {

// Faces sorted by the dominant axis of their normals (six directions, stretch at most sqrt(3)), projected
// along it, and dealt into layers in which none overlaps another, decided exactly. Faces of a layer need not
// hang together. Faces that 64 layers refuse, or that lie in one heap, are charts of their own. Never fails.
std::vector<FlatChart> layered_charts(const Surface& surface, const std::vector<uint32_t>& faces);

}  // namespace kiln
