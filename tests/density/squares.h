// Horizontal squares with a chart each.
#pragma once

#include "tests/import/gltf_builder.h"

namespace kiln::test {

// Mesh 0: a square of `side` metres in x and z from its origin, facing up, whose TEXCOORD_1 is all of [0, 1]
// squared. Mesh 1: the same vertices with material 0.
GltfBuilder square_meshes(float side);
// A node of mesh 0 that stands at (x, y, z), with a name.
json square_at(const std::string& name, double x, double y = 0, double z = 0);
json kiln_extras(json kiln);

}  // namespace kiln::test
