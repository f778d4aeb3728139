// Chooses one of many lights for a point in time logarithmic in their number. Conty Estevez & Kulla
// 2018, Importance Sampling of Many Lights with Adaptive Tree Splitting, sections 4 and 5.1,
// without splitting: one light per vertex. Departures: eight children per node and 32 at the root,
// evaluated together, so that a few lights form one flat list; spheres instead of boxes; the build
// measures the spread of normals by the length of their mean.
#pragma once

#include <cstdint>
#include <vector>

#include "worker/lights/light_bounds.h"

namespace kiln {

class LightTree {
 public:
  LightTree() = default;
  explicit LightTree(const std::vector<LightBounds>& lights);

  // A light for the point p with unit normal n, and the probability of that choice; probability 0:
  // no light arrives there. A hash of `u` and p extends the 23 bits of `u`, so that choices deep in
  // a large tree still have random bits.
  struct Choice {
    uint32_t light = 0;
    float probability = 0.0f;
  };
  Choice choose(const Vec3& p, const Vec3& n, float u) const;
  // The same probability to the last bit: both descend through the same nodes with the same arithmetic.
  float probability(uint32_t light, const Vec3& p, const Vec3& n) const;

  static constexpr int kWidth = 8, kRootWidth = 32;         // children per node, and at the root
  static constexpr int kTrailBits = 3, kRootTrailBits = 5;  // trail bits per level, and at the first
  static constexpr int kDeepest = 20;                       // maximum number of levels

 private:
  typedef float Lanes __attribute__((vector_size(32)));
  static constexpr int kLanes = 8;
  // Eight children side by side.
  struct alignas(64) Group {  // 64 bytes a child
    Lanes x, y, z, radius;    // sphere
    Lanes axis_x, axis_y, axis_z, cos_normals, sin_normals, cos_emission;
    Lanes fold;             // 1: both sides of the axis, -1: one
    Lanes strength;         // relative to the strongest light
    Lanes spread2;          // strength-weighted variance of the position within the sphere
    Lanes reach2;           // squared distance from the centre; negative: no child
    int32_t child[kLanes];  // first group of a node, or ~light
  };
  class Builder;
  // Running sums of the weights of a node's children.
  struct Weights {
    alignas(32) float of[kRootWidth];
    double upto[kRootWidth];
    int width;
    double total() const { return upto[width - 1]; }
  };
  static inline void importance(const Group& group, const Vec3& p, const Vec3& n, Lanes& out);
  void weigh(int32_t node, const Vec3& p, const Vec3& n, Weights& out) const;

  std::vector<Group> groups_;  // the root comes first
  int root_width_ = 0;
  std::vector<uint64_t> trails_;  // by light: the child at each level, the first level in the lowest bits
};

}  // namespace kiln
