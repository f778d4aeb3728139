// The flattened node tree of the scene to bake.
#pragma once

#include <functional>
#include <vector>

#include "coordinator/scene/import/affine.h"
#include "coordinator/scene/import/context.h"

namespace kiln {

struct PlacedNode {
  uint32_t node = 0;
  Affine to_world;
};

// The scene to bake: the file's default, else the first; null if the file has none.
Expected<const GltfScene*> baked_scene(const ImportContext& context);

struct NodeTree {
  static constexpr int kNone = -1;
  std::vector<int> parent;      // by node
  std::vector<uint32_t> roots;  // of the baked scene; without a scene: of the whole file
};

// Errors: an index that does not exist, a node with two parents, a cycle.
Expected<NodeTree> read_node_tree(const ImportContext& context);

// Visits a node and what is below it, parents before children, in the file's order: enter(node, its parent's
// transform) returns whether to descend. Errors: a transform that is not finite or of a wrong length.
Status walk_nodes(const ImportContext& context, uint32_t root, const Affine& parent_to_world,
                  const std::function<bool(const PlacedNode&, const Affine&)>& enter);

// KHR_node_visibility: neither the node nor what is below it is there for light or eye.
bool is_hidden(const ImportContext& context, uint32_t node);

std::string node_name(const ImportContext& context, uint32_t node);

}  // namespace kiln
