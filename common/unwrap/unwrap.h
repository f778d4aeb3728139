// Lightmap charts for a mesh that has none: grown, flattened, proved, merged.
#pragma once

#include <string>

#include "common/unwrap/flatten.h"
#include "common/unwrap/grow.h"
#include "common/unwrap/mesh_charts.h"

namespace kiln {

struct UnwrapSettings {
  float crease_degrees = 45;  // sides whose shading turns by more are seams: a texel never straddles them
  GrowSettings grow;
  FlattenLimits limits;  // L2 1.1: the density differs by a tenth on average; Linf 2: nowhere below half
  uint32_t max_charts = 65536;
  // Work of one mesh, counted in faces projected (a solved face counts 16), so that a limit cuts at the same
  // place on every machine. The default is about a minute on one core at a million faces.
  uint64_t merge_work_per_face = 300;  // after that, further merging is not worth the wait
  uint64_t max_work = uint64_t{200'000'000};
};

struct UnwrapResult {
  MeshCharts charts;
  std::string
      limited;      // why the cheap way was taken for a part, as the rest of a sentence; empty: it was not
  Stretch stretch;  // of the mesh: area-weighted L2, largest Linf
};

// No chart overlaps itself, no triangle is flipped, stretch keeps to the limits (charts made the cheap way:
// sqrt(3)). Coordinates are in metres of the mesh's space. Degenerate triangles lie in the chart of a
// neighbour with no area. Never fails: at worst a triangle is a chart. `threads` (0: all) change nothing but
// the time.
UnwrapResult unwrap(const Mesh& mesh, const UnwrapSettings& settings, unsigned threads = 0);

}  // namespace kiln
