// The faces of one display mesh and the chart that lights each, split where one chart is not enough.
#pragma once

#include "coordinator/scene/display/display.h"
#include "coordinator/scene/lods/source_surface.h"

namespace kiln {

// A display mesh in the world.
class DisplaySurface {
 public:
  explicit DisplaySurface(const Mesh& mesh, const Mat4x3& to_world);
  // A point of a triangle, from barycentrics of vertices 1 and 2.
  DisplayPoint point(uint32_t triangle, const DVec2& b) const;
  DVec3 position(uint32_t triangle, const DVec2& b) const;
  const Mesh& mesh() const { return mesh_; }

 private:
  const Mesh& mesh_;
  Mat4x3 to_world_;
  double side_;  // -1 when mirrored
};

struct DisplayFace {
  uint32_t triangle = 0;
  DVec2 b[3];          // corners
  uint32_t weld[3];    // corners with equal numbers coincide
  bool is_new = true;  // the members below are not set yet
  bool wants[3] = {};  // split edge k, which starts at corner k
  uint32_t placement = 0;
  DVec2 texels[3];

  DVec2 at(double b1, double b2) const { return b[0] + b1 * (b[1] - b[0]) + b2 * (b[2] - b[0]); }
  DVec2 lookup(double b1, double b2) const {
    return texels[0] + b1 * (texels[1] - texels[0]) + b2 * (texels[2] - texels[0]);
  }
};

// The point of a chart that lights a display point: the nearest facing the same way, else the nearest.
LitPoint place_in_chart(const SourceSurface& source, const DisplayPoint& point, const SurfaceSearch& search,
                        uint32_t placement);

// Faces that cover the mesh, split as far as needed and possible. `split`: texels, see LodSettings.
std::vector<DisplayFace> refine_faces(const DisplaySurface& display, const SourceSurface& source,
                                      const SurfaceSearch& search, double split);

}  // namespace kiln
