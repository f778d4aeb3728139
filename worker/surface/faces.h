// A mesh's triangles laid out for shading: each in two adjacent cache lines.
#pragma once

#include <vector>

#include "common/scene/scene.h"

namespace kiln {

struct alignas(128) Face {
  // First line: everything that an untextured flat triangle needs.
  Vec3 p0, e1, e2;  // corner 0 and the edges to corners 1 and 2
  Vec3 ng;          // unit, outer side by winding
  float error;      // see SurfacePoint; in world space only
  bool smooth;      // whether the corners' normals differ from ng
  // Second line.
  alignas(64) Vec3 n[3];
  Vec2 uv[3];  // TEXCOORD_0, 0 if absent
};

// Faces of the mesh in world space, or in its own if `to_world` is null.
std::vector<Face> make_faces(const Mesh& mesh, const Mat4x3* to_world);

// Bound on the rounding of rays and points relative to a triangle whose transformed corners lie within
// `reach` of the origin on each axis.
float reach_error(const Mat4x3& to_world, const Vec3& reach);

}  // namespace kiln
