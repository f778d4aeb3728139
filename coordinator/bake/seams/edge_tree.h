// Finds the edges near an edge: a bounding-box tree over all edges.
#pragma once

#include <span>

#include "coordinator/bake/seams/border.h"

namespace kiln {

class EdgeTree {
 public:
  explicit EdgeTree(std::span<const BorderEdge> edges);

  // Calls visit(other) for the edges of every leaf whose box is within `distance` of the segment p0 p1, until
  // visit returns false. The order is fixed by the edges.
  template <class Visit>
  void for_each_near(const DVec3& p0, const DVec3& p1, double distance, const Visit& visit) const;

 private:
  struct Node {
    DVec3 low, high;
    uint32_t first, count;  // a leaf's edges; count 0: children are the next node and `first`
  };
  struct Part {
    uint32_t node, first, count;
  };
  static uint32_t nodes_of(uint32_t count);
  bool split(const Part& part, Part (&halves)[2]);
  void build(const Part& part);

  static constexpr uint32_t kLeaf = 4;
  std::span<const BorderEdge> edges_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

// A segment expanded by a distance along every axis, for tests against many boxes.
class GrownSegment {
 public:
  GrownSegment(const DVec3& p0, const DVec3& p1, double distance)
      : low_(glm::min(p0, p1) - distance),
        high_(glm::max(p0, p1) + distance),
        from_(p0),
        distance_(distance),
        step_(p1 - p0),
        inverse_(1.0 / step_) {}

  bool meets(const DVec3& low, const DVec3& high) const {
    for (int axis = 0; axis < 3; ++axis)
      if (low[axis] > high_[axis] || high[axis] < low_[axis]) return false;
    double enter = 0, leave = 1;
    for (int axis = 0; axis < 3; ++axis) {
      if (step_[axis] == 0) continue;
      const double t0 = (low[axis] - distance_ - from_[axis]) * inverse_[axis];
      const double t1 = (high[axis] + distance_ - from_[axis]) * inverse_[axis];
      enter = std::max(enter, std::min(t0, t1));
      leave = std::min(leave, std::max(t0, t1));
    }
    return enter <= leave;
  }

 private:
  DVec3 low_, high_, from_;
  double distance_;
  DVec3 step_, inverse_;
};

template <class Visit>
void EdgeTree::for_each_near(const DVec3& p0, const DVec3& p1, double distance, const Visit& visit) const {
  const GrownSegment segment(p0, p1, distance);
  uint32_t stack[64], depth = 0;  // halves: 2^32 edges are 32 deep
  if (!nodes_.empty()) stack[depth++] = 0;
  while (depth > 0) {
    const uint32_t at = stack[--depth];
    const Node& node = nodes_[at];
    if (!segment.meets(node.low, node.high)) continue;
    if (node.count == 0) {
      stack[depth++] = node.first;
      stack[depth++] = at + 1;
    }
    for (uint32_t i = 0; i < node.count; ++i)
      if (!visit(order_[node.first + i])) return;
  }
}

}  // namespace kiln
