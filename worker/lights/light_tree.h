// Chooses one of many lights at a point in time that grows with the logarithm of their number.
// Conty Estevez & Kulla 2018, Importance Sampling of Many Lights with Adaptive Tree Splitting, sections 4 and
// 5.1, without splitting: one light a vertex. Departures: eight children a node and 32 of the root, looked at
// together, so that few lights are one flat list; spheres instead of boxes; the spread of normals in the
// build is measured by the length of their mean.
#pragma once

#include <cstdint>
#include <vector>

#include "worker/lights/light_bounds.h"

namespace kiln {

class LightTree {
 public:
  LightTree() = default;
  explicit LightTree(const std::vector<LightBounds>& lights);

  // A light for the point p with unit normal n, and the probability of that choice; probability 0: no light
  // arrives there. The 23 bits of `u` are refined by a hash of it and p, so that deep down in a large tree
  // there are still bits to decide by.
  struct Choice {
    uint32_t light = 0;
    float probability = 0.0f;
  };
  Choice choose(const Vec3& p, const Vec3& n, float u) const;
  // The same probability, to the last bit: both go down the same nodes by the same arithmetic.
  float probability(uint32_t light, const Vec3& p, const Vec3& n) const;

  static constexpr int kWidth = 8, kRootWidth = 32;         // children of a node, of the root
  static constexpr int kTrailBits = 3, kRootTrailBits = 5;  // of a trail for a level, for the first
  static constexpr int kDeepest = 20;                       // levels that fit

 private:
  typedef float Lanes __attribute__((vector_size(32)));
  static constexpr int kLanes = 8;
  // Eight children side by side.
  struct alignas(64) Group {  // 64 bytes a child
    Lanes x, y, z, radius;    // sphere
    Lanes axis_x, axis_y, axis_z, cos_normals, sin_normals, cos_emission;
    Lanes fold;             // 1: both sides of the axis, -1: one
    Lanes strength;         // relative to the strongest light
    Lanes spread2;          // variance of the place within the sphere, by strength
    Lanes reach2;           // squared distance from the centre; negative: no child
    int32_t child[kLanes];  // first group of a node, or ~light
  };
  class Builder;
  // Weights of a node's children, running sums.
  struct Weights {
    alignas(32) float of[kRootWidth];
    double upto[kRootWidth];
    int width;
    double total() const { return upto[width - 1]; }
  };
  static inline void importance(const Group& group, const Vec3& p, const Vec3& n, Lanes& out);
  void weigh(int32_t node, const Vec3& p, const Vec3& n, Weights& out) const;

  std::vector<Group> groups_;  // the root first
  int root_width_ = 0;
  std::vector<uint64_t> trails_;  // by light: which child at each level, the first in the lowest bits
};

}  // namespace kiln
