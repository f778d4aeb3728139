// Which edges come near an edge: a tree of boxes over all of them.
#pragma once

#include <span>

#include "coordinator/seams/border.h"

namespace kiln {

class EdgeTree {
 public:
  explicit EdgeTree(std::span<const BorderEdge> edges);

  // Calls visit(other) for the edges of every leaf whose box the segment p0 p1 comes to within `distance`
  // of, until it returns false. The order is fixed by the edges.
  template <class Visit>
  void for_each_near(const DVec3& p0, const DVec3& p1, double distance, const Visit& visit) const;

 private:
  struct Node {
    DVec3 low, high;
    uint32_t first, count;  // a leaf's edges; count 0: children are the next node and `first`
  };
  void build(uint32_t first, uint32_t count);

  static constexpr uint32_t kLeaf = 4;
  std::span<const BorderEdge> edges_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

// True if a point of the segment lies in the box grown by `distance` along every axis.
bool meets_box(const DVec3& p0, const DVec3& p1, const DVec3& low, const DVec3& high, double distance);

template <class Visit>
void EdgeTree::for_each_near(const DVec3& p0, const DVec3& p1, double distance, const Visit& visit) const {
  uint32_t stack[64], depth = 0;  // halves: 2^32 edges are 32 deep
  if (!nodes_.empty()) stack[depth++] = 0;
  while (depth > 0) {
    const uint32_t at = stack[--depth];
    const Node& node = nodes_[at];
    if (!meets_box(p0, p1, node.low, node.high, distance)) continue;
    if (node.count == 0) {
      stack[depth++] = node.first;
      stack[depth++] = at + 1;
    }
    for (uint32_t i = 0; i < node.count; ++i)
      if (!visit(order_[node.first + i])) return;
  }
}

}  // namespace kiln
