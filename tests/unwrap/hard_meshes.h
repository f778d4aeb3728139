// Meshes that unwrappers find hard, made in code: a vehicle of panels and bolts, a height field, a cave scan.
#pragma once

#include "tests/atlas/shapes.h"

namespace kiln::test {

// Curved panels with turned edges, fenders, tyres, slats and `bolts` hexagonal bolts with chamfers; sides
// between panel and edge are creases.
Mesh vehicle(uint32_t bolts);
// n x n quads over 100 m, five octaves of smooth noise, 25 m from valley to peak.
Mesh height_field(uint32_t n);
// A closed, branched tunnel seen from inside: marching tetrahedra over a noisy distance, so triangles are
// irregular and many are slivers. `cells` along 40 m.
Mesh cave(uint32_t cells);

}  // namespace kiln::test
