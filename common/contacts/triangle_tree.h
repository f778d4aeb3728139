// A box tree over world-space triangles, for the coordinator's queries before any worker exists.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/scene.h"

namespace kiln {

struct Box3 {
  DVec3 low{1e300}, high{-1e300};
  void add(const DVec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  void add(const Box3& b) {
    low = glm::min(low, b.low);
    high = glm::max(high, b.high);
  }
  // Distance at which a ray from `o` with reciprocal direction `inv` enters before `end`; negative: it
  // misses.
  double enters(const DVec3& o, const DVec3& inv, double end) const {
    double enter = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (low[axis] - o[axis]) * inv[axis], b = (high[axis] - o[axis]) * inv[axis];
      // Not std::min: 0 x infinity on a side that the ray runs along must not part it from the box.
      enter = std::max(enter, a < b ? a : b);
      end = std::min(end, a < b ? b : a);
    }
    return enter > end ? -1 : enter;
  }
  // Square of the distance from `p`; 0 inside.
  double square_distance(const DVec3& p) const {
    const DVec3 out = glm::max(glm::max(low - p, p - high), DVec3(0.0));
    return dot(out, out);
  }
  bool meets(const Box3& b) const {
    for (int axis = 0; axis < 3; ++axis)
      if (low[axis] > b.high[axis] || high[axis] < b.low[axis]) return false;
    return true;
  }
};

// A triangle of an instance, in the world.
struct WorldTriangle {
  uint32_t instance, triangle;
  Vec3 corner[3];
  Box3 box() const {
    Box3 b;
    for (const Vec3& c : corner) b.add(DVec3(c));
    return b;
  }
};
WorldTriangle world_triangle(const Scene& scene, uint32_t instance, uint32_t triangle);

class TriangleTree {
 public:
  // `triangles` outlive the tree.
  explicit TriangleTree(std::span<const WorldTriangle> triangles);

  // Calls visit(index) for every triangle whose box overlaps `box`, in a fixed order.
  template <class Visit>
  void for_each(const Box3& box, const Visit& visit) const {
    walk([&](const Box3& b) { return b.meets(box); }, visit);
  }

  // Calls visit(index) for every triangle whose box lies within the root of `square` of `point`, in a fixed
  // order, not by distance; the caller may lower `square` during the traversal.
  template <class Visit>
  void for_each_near(const DVec3& point, const double& square, const Visit& visit) const {
    walk([&](const Box3& b) { return b.square_distance(point) <= square; }, visit);
  }

  // Calls visit(index, distance) for triangles that a ray hits from either side within `end`, near boxes
  // first; the caller may lower `end` during the traversal, and hits somewhat beyond it may still be visited.
  template <class Visit>
  void for_each_hit(const DVec3& origin, const DVec3& direction, const double& end,
                    const Visit& visit) const {
    if (nodes_.empty()) return;
    const DVec3 inverse = 1.0 / direction;
    const auto enters = [&](const Box3& b) { return b.enters(origin, inverse, 1.01 * end); };
    struct Open {
      uint32_t node;
      double enter;
    };
    Open open[64];
    uint32_t count = 0;
    if (const double enter = enters(nodes_[0].box); enter >= 0) open[count++] = {0, enter};
    while (count) {
      const Open next = open[--count];
      if (next.enter > 1.01 * end) continue;
      const Node& node = nodes_[next.node];
      if (node.count == 0) {
        Open near{node.first, enters(nodes_[node.first].box)};
        Open far{node.first + 1, enters(nodes_[node.first + 1].box)};
        if (far.enter < near.enter) std::swap(near, far);
        if (far.enter >= 0) open[count++] = far;
        if (near.enter >= 0) open[count++] = near;
        continue;
      }
      for (uint32_t i = node.first; i < node.first + node.count; ++i)
        if (enters(boxes_[i]) >= 0)
          if (const double distance = distance_to(order_[i], origin, direction); distance > 0)
            visit(order_[i], distance);
    }
  }

 private:
  template <class Meets, class Visit>
  void walk(const Meets& meets, const Visit& visit) const {
    if (nodes_.empty()) return;
    uint32_t open[64], count = 0;
    open[count++] = 0;
    while (count) {
      const Node& node = nodes_[open[--count]];
      if (!meets(node.box)) continue;
      if (node.count == 0) {
        open[count++] = node.first + 1;
        open[count++] = node.first;
        continue;
      }
      for (uint32_t i = node.first; i < node.first + node.count; ++i)
        if (meets(boxes_[i])) visit(order_[i]);
    }
  }

  // Distance along the ray; not positive: no hit.
  double distance_to(uint32_t triangle, const DVec3& origin, const DVec3& direction) const;

  struct Node {
    Box3 box;
    uint32_t first = 0, count = 0;  // count 0: children are first and first + 1
  };
  std::span<const WorldTriangle> triangles_;
  std::vector<Node> nodes_;
  std::vector<uint32_t> order_;
  std::vector<Box3> boxes_;  // in `order_`
};

}  // namespace kiln
