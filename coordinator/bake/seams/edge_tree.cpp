#include "coordinator/bake/seams/edge_tree.h"

#include <numeric>

#include "common/base/parallel.h"

namespace kiln {

EdgeTree::EdgeTree(std::span<const BorderEdge> edges) : edges_(edges), order_(edges.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (edges.empty()) return;
  const auto count = static_cast<uint32_t>(edges.size());
  nodes_.resize(nodes_of(count));
  // The position of a part's nodes follows from its count, so parts are built in parallel.
  std::vector<Part> parts{{0, 0, count}};
  for (int level = 0; level < 4; ++level) {
    std::vector<Part> next;
    for (const Part& part : parts)
      if (Part halves[2]; split(part, halves)) next.insert(next.end(), halves, halves + 2);
    parts = std::move(next);
  }
  parallel_for(parts.size(), [&](size_t i) { build(parts[i]); });
}

uint32_t EdgeTree::nodes_of(uint32_t count) {
  return count <= kLeaf ? 1 : 1 + nodes_of(count / 2) + nodes_of(count - count / 2);
}

void EdgeTree::build(const Part& part) {
  Part halves[2];
  if (!split(part, halves)) return;
  build(halves[0]);
  build(halves[1]);
}

// Writes the part's node; returns false for a leaf.
bool EdgeTree::split(const Part& part, Part (&halves)[2]) {
  const auto [at, first, count] = part;
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
    return false;
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
  // The contents of each half are fixed; their order is up to the library.
  if (half <= kLeaf) std::sort(begin, begin + half);
  if (count - half <= kLeaf) std::sort(begin + half, begin + count);
  const uint32_t right = at + 1 + nodes_of(half);
  nodes_[at] = {low, high, right, 0};
  halves[0] = {at + 1, first, half};
  halves[1] = {right, first + half, count - half};
  return true;
}

}  // namespace kiln
