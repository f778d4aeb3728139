// Triangles out of index lists, and the repairs that leave only triangles with an area and unit normals.
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

// Removes triangles without area and returns how many. A triangle has none when its height is within the
// rounding of its own coordinates, for then the side it faces is noise.
size_t remove_flat_triangles(const std::vector<Vec3>& positions, Triangles& triangles);

// Removes all but the first of triangles with the same three corners in the same winding, and returns how
// many. Only the first could be seen, and which of them a ray meets would be chance. Opposite ones are both
// kept: each is a surface of its own side.
size_t remove_repeated_triangles(const std::vector<Vec3>& positions, Triangles& triangles);

// Gives every triangle its own vertices with the normal of its plane (glTF: flat normals where absent).
void make_flat_normals(Mesh& mesh);

// Makes normals unit; one without direction becomes the area-weighted mean of its triangles' normals.
// Returns how many were replaced.
size_t repair_normals(Mesh& mesh);

// Drops vertices that no triangle uses, keeping the order of the others.
void drop_unused_vertices(Mesh& mesh);

}  // namespace kiln
