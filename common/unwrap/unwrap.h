// Makes lightmap charts for a mesh without any: grows, flattens, verifies and merges them.
#pragma once

#include <string>

#include "common/unwrap/flatten.h"
#include "common/unwrap/grow.h"
#include "common/unwrap/mesh_charts.h"

namespace kiln {

struct UnwrapSettings {
  float crease_degrees =
      45;  // sides with a larger change of shading normal are seams: no texel straddles them
  GrowSettings grow;
  FlattenLimits limits;  // L2 1.1: the density differs by a tenth on average; Linf 2: nowhere below half
  uint32_t max_charts = 65536;
  // Work per mesh, counted in faces projected (a solved face counts 16), so that a limit cuts at the same
  // point on every machine. The default is about a minute on one core at a million faces.
  uint64_t merge_work_per_face = 300;  // after that, further merging is not worth the wait
  uint64_t max_work = uint64_t{200'000'000};
};

struct UnwrapResult {
  MeshCharts charts;
  std::string limited;  // why a part used the cheap fallback, as the rest of a sentence; empty: none did
  Stretch stretch;      // of the mesh: area-weighted L2, largest Linf
};

// No chart overlaps itself, no triangle is flipped, and stretch stays within the limits (sqrt(3) for charts
// of the cheap fallback). Coordinates are in metres of the mesh's space. Degenerate triangles join a
// neighbour's chart with zero area. Never fails: at worst each triangle is a chart. `threads` (0: all) affect
// only run time.
UnwrapResult unwrap(const Mesh& mesh, const UnwrapSettings& settings, unsigned threads = 0);

}  // namespace kiln
