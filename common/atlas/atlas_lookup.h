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
  // For a triangle with many parts: candidate parts for a point, by cells of its barycentrics.
  struct Grid {
    uint32_t side = 0;
    std::vector<uint32_t> first, faces;  // by cell, side^2 + 1: faces in their order
  };
  static Grid make_grid(const MeshCharts& charts, std::span<const uint32_t> faces);

  const Atlas& atlas_;
  // By set of charts with cut triangles: the parts of each triangle.
  struct Parts {
    std::vector<uint32_t> first, faces;
    std::vector<uint32_t> grid_of;  // by triangle: index into grids + 1; 0: few parts. Empty: no grids
    std::vector<Grid> grids;
  };
  std::vector<Parts> parts_;
};

}  // namespace kiln
