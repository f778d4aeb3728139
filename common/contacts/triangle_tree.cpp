#include "common/contacts/triangle_tree.h"

#include <numeric>

namespace kiln {

WorldTriangle world_triangle(const Scene& scene, uint32_t instance, uint32_t triangle) {
  const Instance& in = scene.instances[instance];
  const Mesh& mesh = scene.meshes[in.mesh];
  WorldTriangle t{instance, triangle, {}};
  for (int k = 0; k < 3; ++k)
    t.corner[k] = transform_point(in.to_world, mesh.positions[mesh.triangles[triangle][k]]);
  return t;
}

TriangleTree::TriangleTree(std::span<const WorldTriangle> triangles) : triangles_(triangles) {
  constexpr uint32_t kLeaf = 4;
  if (triangles.empty()) return;
  const auto count = static_cast<uint32_t>(triangles.size());
  std::vector<Box3> boxes(count);
  std::vector<DVec3> middle(count);
  for (uint32_t i = 0; i < count; ++i) {
    boxes[i] = triangles[i].box();
    middle[i] = 0.5 * (boxes[i].low + boxes[i].high);
  }
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0u);
  nodes_.reserve(size_t{count});
  nodes_.push_back({{}, 0, count});
  // Split at the median centroid of the widest axis: depth is at most log2(count), so for_each's stack
  // suffices for any input.
  for (size_t n = 0; n < nodes_.size(); ++n) {
    Node node = nodes_[n];
    Box3 middles;
    for (uint32_t i = node.first; i < node.first + node.count; ++i) {
      node.box.add(boxes[order_[i]]);
      middles.add(middle[order_[i]]);
    }
    if (node.count > kLeaf) {
      const DVec3 extent = middles.high - middles.low;
      const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
      const auto begin = order_.begin() + node.first;
      const uint32_t half = node.count / 2;
      std::nth_element(begin, begin + half, begin + node.count, [&](uint32_t a, uint32_t b) {
        return middle[a][axis] != middle[b][axis] ? middle[a][axis] < middle[b][axis] : a < b;
      });
      const uint32_t first = node.first, all = node.count;
      node.first = static_cast<uint32_t>(nodes_.size());
      node.count = 0;
      nodes_.push_back({{}, first, half});
      nodes_.push_back({{}, first + half, all - half});
    }
    nodes_[n] = node;
  }
  boxes_.reserve(count);
  for (uint32_t i : order_) boxes_.push_back(boxes[i]);
}

// Moeller & Trumbore 1997, in double.
double TriangleTree::distance_to(uint32_t triangle, const DVec3& o, const DVec3& d) const {
  const WorldTriangle& t = triangles_[triangle];
  const DVec3 a(t.corner[0]), e1 = DVec3(t.corner[1]) - a, e2 = DVec3(t.corner[2]) - a;
  const DVec3 p = cross(d, e2);
  const double det = dot(e1, p);
  if (det == 0) return -1;
  const DVec3 s = o - a, q = cross(s, e1);
  const double u = dot(s, p) / det, v = dot(d, q) / det;
  return u < 0 || v < 0 || u + v > 1 ? -1 : dot(e2, q) / det;
}

}  // namespace kiln
