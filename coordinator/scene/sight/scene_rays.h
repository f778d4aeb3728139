// Ray queries of the coordinator, for choosing cameras, finding unseen charts, and for what texels and paths
// share. Plain float arithmetic, the same on every machine. Light transport uses Embree.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/scene/scene.h"

namespace kiln {

struct RayHit {
  float distance = 0;  // in lengths of the direction
  uint32_t instance = 0, triangle = 0;
  float b1 = 0, b2 = 0;  // barycentrics of vertices 1 and 2
  bool back = false;     // hit the back face, by winding
};

// Boxes in a binary tree. `count` 0: children are first and first + 1.
struct BoxNode {
  Vec3 low{std::numeric_limits<float>::infinity()}, high{-std::numeric_limits<float>::infinity()};
  uint32_t first = 0, count = 0;
  void add(const Vec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  bool overlaps(const BoxNode& b) const {
    for (int axis = 0; axis < 3; ++axis)
      if (low[axis] > b.high[axis] || b.low[axis] > high[axis]) return false;
    return true;
  }
};

class SceneRays {
 public:
  // `scene` outlives this. The tree does not depend on the number of threads (0: all).
  explicit SceneRays(const Scene& scene, unsigned threads = 0);

  // The nearest surface, from either side, for which accept(hit) is true; false: none before `far`.
  template <class Accept>
  bool closest(const Vec3& origin, const Vec3& direction, float far, RayHit& hit, const Accept& accept) const;
  bool closest(const Vec3& origin, const Vec3& direction, float far, RayHit& hit) const {
    return closest(origin, direction, far, hit, [](const RayHit&) { return true; });
  }
  // Whether there is a surface before `far`, from either side.
  bool is_blocked(const Vec3& origin, const Vec3& direction, float far) const;
  // A few triangles, for many short rays among them.
  class NearTriangles;
  // All triangles that a ray may meet which stays within this box and above the plane dot(normal, x) = offset
  // (a normal of 0: within the box).
  NearTriangles near_triangles(const BoxNode& box, const DVec3& normal, double offset) const;

 private:
  struct Triangle {
    Vec3 corner, edge1, edge2;
    uint32_t index;
  };
  struct MeshTree {
    std::vector<BoxNode> nodes;
    std::vector<Triangle> triangles;  // in the order of the leaves
  };
  struct Place {
    uint32_t instance;
    Mat4x3 to_mesh;
  };
  template <class Leaf>
  static bool any_leaf(const std::vector<BoxNode>& nodes, const BoxNode& box, const Leaf& leaf);
  // A hundred levels: binned splits end at kBinnedDepth, and median splits after that within 32.
  static constexpr int kStack = 100;

  static MeshTree tree_of(const Mesh& mesh);
  static float enter(const BoxNode& node, const Vec3& origin, const Vec3& inverse, float far);
  template <class Leaf>
  static void walk(const std::vector<BoxNode>& nodes, const Vec3& origin, const Vec3& direction,
                   const float& far, const Leaf& leaf);
  static bool meets(const Triangle& t, const Vec3& origin, const Vec3& direction, float far, RayHit& hit);

  const Scene& scene_;
  std::vector<MeshTree> meshes_;
  std::vector<BoxNode> top_;
  std::vector<Place> places_;  // in the order of the leaves of top_
};

class SceneRays::NearTriangles {
 public:
  bool empty() const { return count_ == 0; }
  // As SceneRays::is_blocked, for the rays they were gathered for.
  bool is_blocked(const Vec3& origin, const Vec3& direction, float far) const;

 private:
  friend SceneRays;
  static constexpr size_t kMost = 64;
  explicit NearTriangles(const SceneRays& rays) : rays_(rays) {}
  bool add(const Place& place, const Triangle& triangle) {
    if (count_ == kMost) return false;
    places_[count_] = &place;
    triangles_[count_++] = triangle;
    return true;
  }

  const SceneRays& rays_;
  bool overflows_ = false;  // there are more than kMost: rays walk through the tree
  size_t count_ = 0;
  std::array<const Place*, kMost> places_;
  std::array<Triangle, kMost> triangles_;
};

// Distance at which a ray enters the box; infinite if it does not before `far`.
inline float SceneRays::enter(const BoxNode& node, const Vec3& o, const Vec3& inverse, float far) {
  float in = 0, out = far;
  for (int axis = 0; axis < 3; ++axis) {
    const float a = (node.low[axis] - o[axis]) * inverse[axis],
                b = (node.high[axis] - o[axis]) * inverse[axis];
    // Not std::min: 0 x infinity on a side that the ray runs along must not part it from the box.
    in = std::max(in, a < b ? a : b);
    out = std::min(out, a < b ? b : a);
  }
  // Slab rounding must not miss geometry that lies on a side (Ize 2013).
  return in <= out * 1.0000004f ? in : std::numeric_limits<float>::infinity();
}

template <class Leaf>
void SceneRays::walk(const std::vector<BoxNode>& nodes, const Vec3& origin, const Vec3& direction,
                     const float& far, const Leaf& leaf) {
  const Vec3 inverse = 1.0f / direction;
  if (nodes.empty() || !(enter(nodes[0], origin, inverse, far) <= far)) return;
  struct Open {
    uint32_t node;
    float at;
  } open[kStack];
  int count = 0;
  open[count++] = {0, 0.0f};
  while (count) {
    const Open next = open[--count];
    if (next.at > far) continue;
    const BoxNode& node = nodes[next.node];
    if (node.count) {
      leaf(node);
      continue;
    }
    const float a = enter(nodes[node.first], origin, inverse, far),
                b = enter(nodes[node.first + 1], origin, inverse, far);
    const uint32_t nearer = b < a;
    if (std::max(a, b) <= far) open[count++] = {node.first + 1 - nearer, std::max(a, b)};
    if (std::min(a, b) <= far) open[count++] = {node.first + nearer, std::min(a, b)};
  }
}

// Moeller & Trumbore 1997.
inline bool SceneRays::meets(const Triangle& t, const Vec3& o, const Vec3& d, float far, RayHit& hit) {
  const Vec3 p = cross(d, t.edge2);
  const float det = dot(t.edge1, p);
  if (det == 0) return false;
  const Vec3 s = o - t.corner;
  const float u = dot(s, p) / det;
  if (!(u >= 0 && u <= 1)) return false;
  const Vec3 q = cross(s, t.edge1);
  const float v = dot(d, q) / det;
  if (!(v >= 0 && u + v <= 1)) return false;
  const float distance = dot(t.edge2, q) / det;
  if (!(distance > 0 && distance < far)) return false;
  hit.distance = distance;
  hit.triangle = t.index;
  hit.b1 = u;
  hit.b2 = v;
  hit.back = det < 0;
  return true;
}

inline bool SceneRays::is_blocked(const Vec3& origin, const Vec3& direction, float far) const {
  bool found = false;
  walk(top_, origin, direction, far, [&](const BoxNode& top) {
    for (uint32_t i = top.first; i < top.first + top.count && !found; ++i) {
      const Place& place = places_[i];
      const MeshTree& mesh = meshes_[scene_.instances[place.instance].mesh];
      const Vec3 o = transform_point(place.to_mesh, origin), d = transform_vector(place.to_mesh, direction);
      walk(mesh.nodes, o, d, far, [&](const BoxNode& node) {
        RayHit hit;
        for (uint32_t k = node.first; k < node.first + node.count && !found; ++k)
          found = meets(mesh.triangles[k], o, d, far, hit);
        if (found) far = -1;  // both walks end: every other box is farther
      });
    }
  });
  return found;
}

template <class Accept>
bool SceneRays::closest(const Vec3& origin, const Vec3& direction, float far, RayHit& hit,
                        const Accept& accept) const {
  bool found = false;
  walk(top_, origin, direction, far, [&](const BoxNode& top) {
    for (uint32_t i = top.first; i < top.first + top.count; ++i) {
      const Place& place = places_[i];
      const MeshTree& mesh = meshes_[scene_.instances[place.instance].mesh];
      const Vec3 o = transform_point(place.to_mesh, origin), d = transform_vector(place.to_mesh, direction);
      walk(mesh.nodes, o, d, far, [&](const BoxNode& node) {
        for (uint32_t k = node.first; k < node.first + node.count; ++k) {
          RayHit candidate;
          candidate.instance = place.instance;
          if (!meets(mesh.triangles[k], o, d, far, candidate) || !accept(candidate)) continue;
          hit = candidate;
          far = candidate.distance;
          found = true;
        }
      });
    }
  });
  return found;
}

// Whether leaf(node) is true for a leaf that overlaps the box.
template <class Leaf>
bool SceneRays::any_leaf(const std::vector<BoxNode>& nodes, const BoxNode& box, const Leaf& leaf) {
  if (nodes.empty()) return false;
  uint32_t open[kStack];
  int count = 0;
  open[count++] = 0;
  while (count) {
    const BoxNode& node = nodes[open[--count]];
    if (!node.overlaps(box)) continue;
    if (node.count) {
      if (leaf(node)) return true;
      continue;
    }
    open[count++] = node.first;
    open[count++] = node.first + 1;
  }
  return false;
}

inline SceneRays::NearTriangles SceneRays::near_triangles(const BoxNode& box, const DVec3& normal,
                                                          double offset) const {
  NearTriangles near(*this);
  near.overflows_ = any_leaf(top_, box, [&](const BoxNode& top) {
    for (uint32_t i = top.first; i < top.first + top.count; ++i) {
      const Place& place = places_[i];
      const Instance& instance = scene_.instances[place.instance];
      const MeshTree& mesh = meshes_[instance.mesh];
      BoxNode own;  // around the box's corners in the mesh's space
      for (int corner = 0; corner < 8; ++corner)
        own.add(transform_point(place.to_mesh,
                                {corner & 1 ? box.high.x : box.low.x, corner & 2 ? box.high.y : box.low.y,
                                 corner & 4 ? box.high.z : box.low.z}));
      const Mat4x3& m = instance.to_world;
      const DVec3 across(dot(normal, DVec3(m[0])), dot(normal, DVec3(m[1])), dot(normal, DVec3(m[2])));
      const double least = offset - dot(normal, DVec3(m[3]));
      const auto overflows = [&](const BoxNode& node) {
        for (uint32_t k = node.first; k < node.first + node.count; ++k) {
          const Triangle& t = mesh.triangles[k];
          BoxNode around;
          bool is_above = false;
          for (const Vec3& corner : {t.corner, t.corner + t.edge1, t.corner + t.edge2}) {
            around.add(corner);
            is_above |= dot(across, DVec3(corner)) >= least;
          }
          if (is_above && around.overlaps(own) && !near.add(place, t)) return true;
        }
        return false;
      };
      if (any_leaf(mesh.nodes, own, overflows)) return true;
    }
    return false;
  });
  return near;
}

inline bool SceneRays::NearTriangles::is_blocked(const Vec3& origin, const Vec3& direction, float far) const {
  if (overflows_) return rays_.is_blocked(origin, direction, far);
  const Place* place = nullptr;
  Vec3 o, d;
  for (size_t i = 0; i < count_; ++i) {
    if (places_[i] != place) {
      place = places_[i];
      o = transform_point(place->to_mesh, origin);
      d = transform_vector(place->to_mesh, direction);
    }
    RayHit hit;
    if (meets(triangles_[i], o, d, far, hit)) return true;
  }
  return false;
}

}  // namespace kiln
