// Charts of a mesh: its faces flattened piece by piece.
#pragma once

#include <cstdint>
#include <vector>

#include "common/raster/triangle2.h"
#include "common/scene/scene.h"

namespace kiln {

// A part of a triangle: its corners by the barycentrics (b1, b2) of the triangle's vertices 1 and 2.
struct FacePart {
  uint32_t triangle = 0;
  Vec2 corner[3] = {{0, 0}, {1, 0}, {0, 1}};
};

// `corner_uv` holds 3 lightmap coordinates per face in a space of the mesh's own (authored TEXCOORD_1, or
// flattened metres); placements map it to texels. A face is a triangle of the mesh, or a part of one where
// charts had to be cut through triangles.
struct MeshCharts {
  std::vector<Vec2> corner_uv;
  std::vector<uint32_t> chart_of_face;
  std::vector<FacePart> parts;  // by face; empty: face i is triangle i
  uint32_t chart_count = 0;
  bool generated = false;  // no usable TEXCOORD_1: unwrapped by Kiln

  size_t face_count() const { return chart_of_face.size(); }
  uint32_t triangle_of(size_t face) const {
    return parts.empty() ? static_cast<uint32_t>(face) : parts[face].triangle;
  }
};

// Corners of a face in the mesh's space.
inline void face_corners(const Mesh& mesh, const MeshCharts& charts, size_t face, Vec3 (&corner)[3]) {
  const UVec3& v = mesh.triangles[charts.triangle_of(face)];
  const Vec3 p[3] = {mesh.positions[v.x], mesh.positions[v.y], mesh.positions[v.z]};
  for (int k = 0; k < 3; ++k)
    corner[k] = charts.parts.empty() ? p[k]
                                     : p[0] + charts.parts[face].corner[k].x * (p[1] - p[0]) +
                                           charts.parts[face].corner[k].y * (p[2] - p[0]);
}

// The face in its chart's own space.
inline Triangle2 uv_triangle(const MeshCharts& charts, size_t face) {
  Triangle2 t;
  for (size_t k = 0; k < 3; ++k) t.c[k] = DVec2(charts.corner_uv[3 * face + k]);
  return t;
}

}  // namespace kiln
