// Charts for a mesh without usable lightmap coordinates.
#pragma once

#include "common/unwrap/mesh_charts.h"

namespace kiln {

// Triangles grouped by face normal (no further than `crease_degrees`, at most 75, from the one that began
// the group; groups are connected) and projected along the group's mean normal, in the mesh's unit. No
// chart overlaps itself, none holds a flipped triangle. Never fails: at worst a triangle is a chart.
MeshCharts unwrap_simple(const Mesh& mesh, float crease_degrees);

}  // namespace kiln
