// A bevelled crate in three levels of detail, made in code, in a place with a lamp.
#pragma once

#include "coordinator/scene/lods/lods.h"
#include "coordinator/scene/lods/refine.h"
#include "tests/leaks/leak_bake.h"

namespace kiln::test {

constexpr float kCrateSize = 1.0f, kCrateBevel = 0.06f;  // metres

// A box of `size` about the origin whose edges are rounded: each by `segments` pieces on either side, with
// smooth normals. 0 segments: six flat faces of two triangles.
Mesh crate(const Vec3& size, float bevel, int segments);
Mesh crate_level(int level);  // 4, 1 and 0 segments: 972, 108 and 12 triangles

// The crate hangs over a floor, beside a wall, under an emissive square and a dim sky, all grey: instance 0
// is the crate of this level, the only one with texels worth the name.
Scene crate_scene(int level);
AtlasSettings crate_atlas(const Scene& scene, float texels_per_metre);

// A display of one mesh, at `to_world`, whose baked surface is instance `source`.
Display display_of(const Mesh& mesh, const Mat4x3& to_world, uint32_t source = 0);

// Luminance of E that the projection gives on a face.
AtlasPlace projected_place(const Atlas& atlas, const ProjectedCharts& projected, size_t face, double b1,
                           double b2);
// World position and shading normal on a face of the projection.
DisplayPoint display_point(const Display& display, const ProjectedCharts& projected, size_t face, double b1,
                           double b2);

}  // namespace kiln::test
