// Chooses one of many lights at a point in time that grows with the logarithm of their number.
// Conty Estevez & Kulla 2018, Importance Sampling of Many Lights with Adaptive Tree Splitting, sections 4 and
// 5.1, without splitting: one light a vertex. Departures: four children a node, looked at together, so that
// few lights are one flat list; spheres instead of boxes; the spread of normals in the build is measured by
// the length of their mean.
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

  static constexpr int kWidth = 4;
  static constexpr int kDeepest = 32;  // levels: two bits of a trail each

 private:
  typedef float Lanes __attribute__((vector_size(4 * kWidth)));
  // Four children side by side: 56 bytes each.
  struct alignas(32) Node {
    Lanes x, y, z, radius;  // sphere
    Lanes axis_x, axis_y, axis_z, cos_normals, sin_normals, cos_emission;
    Lanes fold;             // 1: both sides of the axis, -1: one
    Lanes strength;         // relative to the strongest light
    Lanes reach2;           // squared distance from the centre; negative: no child
    int32_t child[kWidth];  // node, or ~light
  };
  class Builder;
  static Lanes importance(const Node& node, const Vec3& p, const Vec3& n);

  std::vector<Node> nodes_;
  std::vector<uint64_t> trails_;  // by light: which child at each level, the first in the lowest bits
};

}  // namespace kiln
