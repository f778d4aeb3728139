// The unwrapper's view of a mesh: faces, neighbours across sides, and sharp sides.
#pragma once

#include <span>
#include <vector>

#include "common/scene/scene.h"

namespace kiln {

// Side k of face f, from corner k to the next, has the number 3 f + k.
inline uint32_t next_corner(uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

struct Surface {
  static constexpr uint32_t kNone = ~0u;

  // Sides whose shading normals differ by more than `crease_degrees` at either end are sharp.
  Surface(const Mesh& mesh, float crease_degrees);

  const Mesh& mesh;
  std::vector<DVec3> normal;       // by face: unit; zero: the face is degenerate
  std::vector<double> area;        // by face
  std::vector<uint32_t> opposite;  // by side: the side of the neighbour that runs the other way, or kNone.
                                   // Sharp sides and those of degenerate faces have none, so a chart that
                                   // is grown over opposites keeps to the sheet, its orientation and creases.
  std::vector<uint32_t> attached;  // by face: for a degenerate one a face beside it, or kNone

  size_t face_count() const { return area.size(); }
  DVec3 corner(uint32_t c) const {
    return DVec3(mesh.positions[mesh.triangles[c / 3][static_cast<int>(c % 3)]]);
  }
  double side_length(uint32_t side) const { return length(corner(next_corner(side)) - corner(side)); }

 private:
  void pair_sides(float crease_degrees);
};

}  // namespace kiln
