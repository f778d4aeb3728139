// Solids made in code: what an unwrapper meets, from a box to a million triangles.
#pragma once

#include "tests/atlas/shapes.h"

namespace kiln::test {

Mesh torus(uint32_t n, float major, float minor);       // 2 n x n quads, smooth
Mesh blob(uint32_t n);                                  // about 4 n^2 triangles: a sphere with bumps, smooth
Mesh terrain(uint32_t n);                               // n x n quads, hills and a ridge
Mesh tube(uint32_t n, uint32_t rows);                   // open cylinder of n quads around
Mesh tree_of_cones(uint32_t levels);                    // cones on cones, touching, not joined
Mesh letters(uint32_t count);                           // extruded outlines with holes and bevel-less edges
Mesh moebius(uint32_t n);                               // cannot be oriented
Mesh klein(uint32_t n);                                 // closed, crosses itself, cannot be oriented
Mesh fan(uint32_t blades);                              // many faces at one side
Mesh with_noise(Mesh mesh, float size, uint64_t seed);  // every position moved; duplicates stay together

}  // namespace kiln::test
