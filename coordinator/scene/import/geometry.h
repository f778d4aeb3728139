// Builds triangles from index lists, and repairs them so that only triangles with area and unit normals
// remain.
#pragma once

#include <optional>
#include <vector>

#include "common/math/vec.h"
#include "common/scene/scene.h"

namespace kiln {

struct Triangles {
  std::vector<UVec3> vertices;
  std::vector<uint32_t> source;  // index of the triangle in the file's primitive
};

// Modes 4, 5, 6 of glTF (list, strip, fan) to triangles of one winding (section 3.7.2.1). Indices that do
// not make up a whole triangle are dropped, as GPUs do.
Triangles triangulate(const std::vector<uint32_t>& indices, int mode);

// Removes triangles without area and returns how many. A triangle counts as having none when its height is
// within the rounding of its coordinates, because then its orientation is noise.
size_t remove_flat_triangles(const std::vector<Vec3>& positions, Triangles& triangles);

// Removes all but the first of triangles with the same three corners in the same winding, and returns how
// many. Only one of them can be visible, and which one a ray hits would be arbitrary. Opposite windings are
// both kept: each is the surface of its own side.
size_t remove_repeated_triangles(const std::vector<Vec3>& positions, Triangles& triangles);

// Gives every triangle its own vertices with the normal of its plane (glTF: flat normals where absent).
void make_flat_normals(Mesh& mesh);

// Makes normals unit; a zero normal becomes the area-weighted mean of its triangles' normals. Returns how
// many were replaced.
size_t repair_normals(Mesh& mesh);

// Drops vertices that no triangle uses, keeping the order of the others.
void drop_unused_vertices(Mesh& mesh);

}  // namespace kiln
