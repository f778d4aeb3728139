#include "coordinator/seams/edge_tree.h"

#include <numeric>

namespace kiln {

EdgeTree::EdgeTree(std::span<const BorderEdge> edges) : edges_(edges), order_(edges.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (!edges.empty()) build(0, static_cast<uint32_t>(edges.size()));
}

void EdgeTree::build(uint32_t first, uint32_t count) {
  const auto at = static_cast<uint32_t>(nodes_.size());
  nodes_.emplace_back();
  DVec3 low(std::numeric_limits<double>::infinity()), high = -low, middle_low = low, middle_high = high;
  for (uint32_t i = first; i < first + count; ++i) {
    const BorderEdge& e = edges_[order_[i]];
    low = glm::min(low, glm::min(e.p[0], e.p[1]));
    high = glm::max(high, glm::max(e.p[0], e.p[1]));
    middle_low = glm::min(middle_low, e.p[0] + e.p[1]);
    middle_high = glm::max(middle_high, e.p[0] + e.p[1]);
  }
  if (count <= kLeaf) {
    nodes_[at] = {low, high, first, count};
    return;
  }
  const DVec3 extent = middle_high - middle_low;
  const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  const uint32_t half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](uint32_t a, uint32_t b) {
    const double x = edges_[a].p[0][axis] + edges_[a].p[1][axis];
    const double y = edges_[b].p[0][axis] + edges_[b].p[1][axis];
    return x != y ? x < y : a < b;
  });
  // What is in each half is fixed; in which order is the library's choice.
  if (half <= kLeaf) std::sort(begin, begin + half);
  if (count - half <= kLeaf) std::sort(begin + half, begin + count);
  build(first, half);
  const auto right = static_cast<uint32_t>(nodes_.size());
  build(first + half, count - half);
  nodes_[at] = {low, high, right, 0};
}

bool meets_box(const DVec3& p0, const DVec3& p1, const DVec3& low, const DVec3& high, double distance) {
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = p1[axis] - p0[axis];
    const double a = low[axis] - distance - p0[axis], b = high[axis] + distance - p0[axis];
    if (d == 0) {
      if (a > 0 || b < 0) return false;
      continue;
    }
    const double t0 = a / d, t1 = b / d;
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return enter <= leave;
}

}  // namespace kiln
