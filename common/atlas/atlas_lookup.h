// From a point of the surface to its place in the lightmap.
#pragma once

#include <span>

#include "common/atlas/atlas.h"

namespace kiln {

struct AtlasPlace {
  DVec2 texels;  // coordinates on the page
  uint32_t page = 0, placement = 0;
};

class AtlasLookup {
 public:
  explicit AtlasLookup(const Atlas& atlas);  // outlives the lookup

  // Whether the triangle has a face in the atlas.
  bool holds(uint32_t instance, uint32_t triangle) const;
  // Looks up the point with barycentrics (b1, b2) of vertices 1 and 2 of a triangle. On a line where a
  // triangle was cut, the first face wins.
  AtlasPlace at(uint32_t instance, uint32_t triangle, double b1, double b2) const;
  // The face that contains the point; `b1`, `b2` become barycentrics of that face.
  uint32_t face_at(uint32_t instance, uint32_t triangle, double& b1, double& b2) const;

 private:
  const Atlas& atlas_;
  // By set of charts with cut triangles: the parts of each triangle.
  struct Parts {
    std::vector<uint32_t> first, faces;
    // For triangles with many parts: those that a point may be in, by a quadtree over the barycentrics.
    struct Node {
      uint32_t children = 0;         // the first of four; 0: a leaf
      uint32_t first = 0, last = 0;  // of a leaf: faces in `held`, in their order
    };
    std::vector<uint32_t> root_of;  // by triangle: index into nodes; kFew: few parts. Empty: no trees
    std::vector<Node> nodes;
    std::vector<uint32_t> held;
    std::span<const uint32_t> near(uint32_t triangle, double b1, double b2) const;
  };
  class TreeBuilder;
  std::vector<Parts> parts_;
};

}  // namespace kiln
