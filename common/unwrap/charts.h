// Charts of one mesh: sets of triangles connected in lightmap space.
#pragma once

#include <filesystem>
#include <numeric>
#include <span>

#include "common/base/status.h"
#include "common/unwrap/mesh_charts.h"
#include "common/unwrap/unwrap.h"

namespace kiln {

// Disjoint sets of indices.
class UnionFind {
 public:
  explicit UnionFind(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  // The smaller index represents the set, so representatives do not depend on merge order.
  void merge(uint32_t a, uint32_t b) {
    a = find(a);
    b = find(b);
    if (a < b)
      parent_[b] = a;
    else
      parent_[a] = b;
  }

 private:
  std::vector<uint32_t> parent_;
};

// A number for each corner (3 per triangle) such that corners have the same number exactly when their
// positions, and if `uv` is not empty their entries in it (by vertex), are equal.
std::vector<uint32_t> weld_corners(const Mesh& mesh, std::span<const Vec2> uv);

// One side of a triangle between welded corners a < b.
struct Edge {
  uint32_t a, b, triangle;
  uint32_t from, to;  // corner indices, in the triangle's order: a is the weld of `from` or of `to`
};
// All sides, sorted by (a, b, triangle), without those that weld to a point.
std::vector<Edge> sorted_edges(const std::vector<uint32_t>& weld);

// Triangles by chart.
struct ChartTriangles {
  std::vector<uint32_t> first;  // chart_count + 1
  std::vector<uint32_t> triangles;
  std::span<const uint32_t> of(uint32_t chart) const {
    return {triangles.data() + first[chart], triangles.data() + first[chart + 1]};
  }
};
ChartTriangles triangles_by_chart(const MeshCharts& charts);

// Charts of the mesh's own TEXCOORD_1. Two triangles are in one chart when they share a side with equal
// positions and coordinates at both ends and lie on opposite sides of it (so a fold separates charts).
// Errors: no TEXCOORD_1, not finite, no area; the message completes a sentence that begins with the mesh's
// name: "has no TEXCOORD_1".
Expected<MeshCharts> authored_charts(const Mesh& mesh);

// Share of the mesh's area without area in lightmap space: it gets no light.
double degenerate_share(const Mesh& mesh, const MeshCharts& charts);

// Share in [0, 1] of covered points that more than one triangle of the same chart covers.
double self_overlap(const MeshCharts& charts);

// The mesh's own charts where they can be packed, else generated ones. `complaint`: why TEXCOORD_1 could
// not be used (as authored_charts), empty if it was used or is absent. `limited`: as UnwrapResult.
struct ChartsForPacking {
  MeshCharts charts;
  std::string complaint, limited;
};
struct UnwrapChoice {
  UnwrapSettings settings;
  bool always = false;          // ignore TEXCOORD_1
  std::filesystem::path cache;  // folder of unwrapped meshes; empty: none
};
ChartsForPacking charts_for_packing(const Mesh& mesh, const UnwrapChoice& choice, unsigned threads);

}  // namespace kiln
