// Pieces to build walls of, and maps that hold a known field.
#pragma once

#include <functional>

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"

namespace kiln::test {

// width x height metres in the plane z = 0 from the origin, facing +z, of columns x rows quads.
Mesh panel(float width, float height, uint32_t columns, uint32_t rows);
// A part of a cylinder's mantle about +y, `turns` of 360 degrees from +x towards +z, smooth normals outwards.
Mesh mantle(float radius, float height, uint32_t sides, double turns);
// A cube of flat faces, and a box whose edges and corners are bevelled, with the faces' normals on their
// corners so that shading is smooth across bevels. Both stand on y = 0 about the origin.
Mesh cube(float size);
Mesh bevelled_box(float size, float bevel);

Mat4x3 moved(const Vec3& to);

struct Pieces {
  Scene scene;
  Pieces& add(const Mesh& mesh, const Mat4x3& to_world);
};

// Eight panels, four abreast and two high, 8 x 3 metres in the plane z = 0 facing +z: of three
// tessellations, one mirrored, one turned by 180 degrees. Cuts of the upper row are not above the lower ones.
Pieces wall_of_eight();

Atlas packed(const Scene& scene, float texels_per_metre);

// A measured map with E = field(world position of the texel's centre, normal) in all channels. Centres
// outside the faces are extrapolated, so a linear field is linear on every chart. Planes: E, L1x (E - 5, to
// have a signed one), error (1 % of E), samples.
Lightmap field_map(const Scene& scene, const Atlas& atlas,
                   const std::function<double(const DVec3&, const Vec3&)>& field);

}  // namespace kiln::test
