// Corners and sides of a mesh by value, so that vertices duplicated for normals or materials still connect.
#include <algorithm>
#include <array>
#include <bit>

#include "common/unwrap/charts.h"

namespace kiln {
namespace {

// Equal floats have equal bits once -0 is 0; the order of bits is any fixed order.
uint32_t key_bits(float f) {
  return std::bit_cast<uint32_t>(f == 0.0f ? 0.0f : f);
}

using VertexKey = std::array<uint32_t, 5>;

VertexKey vertex_key(const Mesh& mesh, std::span<const Vec2> uv, uint32_t v) {
  const Vec3& p = mesh.positions[v];
  const Vec2 q = uv.empty() ? Vec2(0.0f) : uv[v];
  return {key_bits(p.x), key_bits(p.y), key_bits(p.z), key_bits(q.x), key_bits(q.y)};
}

}  // namespace

std::vector<uint32_t> weld_corners(const Mesh& mesh, std::span<const Vec2> uv) {
  struct Keyed {
    VertexKey key;
    uint32_t vertex;
    auto operator<=>(const Keyed&) const = default;
  };
  std::vector<Keyed> sorted(mesh.positions.size());
  for (uint32_t v = 0; v < sorted.size(); ++v) sorted[v] = {vertex_key(mesh, uv, v), v};
  std::sort(sorted.begin(), sorted.end());
  std::vector<uint32_t> of_vertex(sorted.size());
  uint32_t number = 0;
  for (size_t i = 0; i < sorted.size(); ++i) {
    if (i > 0 && sorted[i].key != sorted[i - 1].key) ++number;
    of_vertex[sorted[i].vertex] = number;
  }
  std::vector<uint32_t> weld;
  weld.reserve(3 * mesh.triangles.size());
  for (const UVec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) weld.push_back(of_vertex[t[k]]);
  return weld;
}

std::vector<Edge> sorted_edges(const std::vector<uint32_t>& weld) {
  std::vector<Edge> edges;
  edges.reserve(weld.size());
  for (uint32_t from = 0; from < weld.size(); ++from) {
    const uint32_t to = from % 3 == 2 ? from - 2 : from + 1;
    if (weld[from] != weld[to])
      edges.push_back({std::min(weld[from], weld[to]), std::max(weld[from], weld[to]), from / 3, from, to});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& p, const Edge& q) {
    return std::array{p.a, p.b, p.from} < std::array{q.a, q.b, q.from};
  });
  return edges;
}

}  // namespace kiln
