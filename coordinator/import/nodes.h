// The node tree of the scene that is baked, flattened.
#pragma once

#include <vector>

#include "coordinator/import/affine.h"
#include "coordinator/import/context.h"

namespace kiln {

struct PlacedNode {
  uint32_t node = 0;
  Affine to_world;
};

// The scene that is baked: the file's default, else the first; null when the file has none.
Expected<const GltfScene*> baked_scene(const ImportContext& context);

// Every node of the baked scene (without a scene: of the whole file), parents before children, in the
// file's order. Errors: an index that does not exist, a node with two parents, a cycle, a transform that
// is not finite or of a wrong length.
Expected<std::vector<PlacedNode>> place_nodes(const ImportContext& context);

std::string node_name(const ImportContext& context, uint32_t node);

}  // namespace kiln
