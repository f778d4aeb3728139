#include "coordinator/scene/import/nodes.h"

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr int kNone = NodeTree::kNone;

// The parent of every node; errors for two parents and for cycles.
Expected<std::vector<int>> find_parents(const ImportContext& context) {
  const auto& nodes = context.model.nodes;
  std::vector<int> parent(nodes.size(), kNone);
  for (size_t i = 0; i < nodes.size(); ++i)
    for (const int child : nodes[i].children) {
      if (child < 0 || static_cast<size_t>(child) >= nodes.size())
        return context.bad(text("{}: child {} does not exist, there are {} nodes", node_name(context, i),
                                child, nodes.size()));
      int& slot = parent[static_cast<size_t>(child)];
      if (slot != kNone)
        return context.bad(text("{} has two parents, {} and {}", node_name(context, child),
                                node_name(context, slot), node_name(context, i)));
      slot = static_cast<int>(i);
    }
  // With one parent each, a node that does not reach a root is on a cycle.
  std::vector<uint32_t> reached(nodes.size(), 0);  // visited by the walk of this number
  for (uint32_t start = 0; start < nodes.size(); ++start) {
    int at = static_cast<int>(start);
    while (at != kNone && reached[static_cast<size_t>(at)] == 0) {
      reached[static_cast<size_t>(at)] = start + 1;
      at = parent[static_cast<size_t>(at)];
    }
    if (at != kNone && reached[static_cast<size_t>(at)] == start + 1)
      return context.bad(text("{} is its own ancestor: the nodes form a cycle", node_name(context, at)));
  }
  return parent;
}

Expected<DVec3> vector_of(const ImportContext& context, uint32_t node, const char* what,
                          const std::vector<double>& values, const DVec3& otherwise) {
  if (values.empty()) return otherwise;
  if (values.size() != 3)
    return context.bad(text("{}: its {} has {} numbers", node_name(context, node), what, values.size()));
  return DVec3(values[0], values[1], values[2]);
}

Expected<Affine> local_transform(const ImportContext& context, uint32_t index) {
  const GltfNode& node = context.model.nodes[index];
  if (!node.matrix.empty()) {
    const auto& m = node.matrix;
    if (m.size() != 16)
      return context.bad(text("{}: its matrix has {} numbers", node_name(context, index), m.size()));
    return Affine{{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[12], m[13], m[14]}};
  }
  KILN_TRY(const DVec3 translation, vector_of(context, index, "translation", node.translation, DVec3(0)));
  KILN_TRY(const DVec3 scale, vector_of(context, index, "scale", node.scale, DVec3(1)));
  double q[4] = {0, 0, 0, 1};
  if (!node.rotation.empty() && node.rotation.size() != 4)
    return context.bad(
        text("{}: its rotation has {} numbers", node_name(context, index), node.rotation.size()));
  for (size_t i = 0; i < node.rotation.size(); ++i) q[i] = node.rotation[i];
  return from_trs(translation, q, scale);
}

Expected<std::vector<uint32_t>> find_roots(const ImportContext& context, const std::vector<int>& parent) {
  KILN_TRY(const GltfScene* scene, baked_scene(context));
  std::vector<uint32_t> roots;
  if (!scene) {
    for (uint32_t i = 0; i < parent.size(); ++i)
      if (parent[i] == kNone) roots.push_back(i);
    return roots;
  }
  std::vector<bool> listed(parent.size(), false);
  for (const int root : scene->nodes) {
    if (root < 0 || static_cast<size_t>(root) >= parent.size())
      return context.bad(text("the scene names node {}, there are {}", root, parent.size()));
    const auto index = static_cast<uint32_t>(root);
    if (parent[index] != kNone || listed[index])
      return context.bad(text("the scene names {}, which {}", node_name(context, index),
                              listed[index] ? "it has named already" : "is a child of another node"));
    listed[index] = true;
    roots.push_back(index);
  }
  return roots;
}

}  // namespace

std::string node_name(const ImportContext& context, uint32_t node) {
  return element("node", node, context.model.nodes[node].name);
}

bool is_hidden(const ImportContext& context, uint32_t node) {
  const auto& extensions = context.model.nodes[node].extensions;
  const auto found = extensions.find("KHR_node_visibility");
  const GltfValue* visible = found == extensions.end() ? nullptr : found->second.find("visible");
  return visible && visible->kind == GltfValue::Kind::kFlag && visible->number == 0;
}

Expected<const GltfScene*> baked_scene(const ImportContext& context) {
  const auto& scenes = context.model.scenes;
  const int chosen = context.model.default_scene;
  if (chosen >= 0 && static_cast<size_t>(chosen) >= scenes.size())
    return context.bad(text("scene {} does not exist, there are {}", chosen, scenes.size()));
  if (scenes.empty()) return nullptr;
  return &scenes[chosen < 0 ? 0 : static_cast<size_t>(chosen)];
}

Expected<NodeTree> read_node_tree(const ImportContext& context) {
  NodeTree tree;
  KILN_TRY(tree.parent, find_parents(context));
  KILN_TRY(tree.roots, find_roots(context, tree.parent));
  return tree;
}

Status walk_nodes(const ImportContext& context, uint32_t root, const Affine& parent_to_world,
                  const std::function<bool(const PlacedNode&, const Affine&)>& enter) {
  std::vector<PlacedNode> open;  // an explicit stack, because the depth of a file is untrusted
  open.push_back({root, parent_to_world});
  while (!open.empty()) {
    const PlacedNode above = open.back();  // to_world is the parent's
    open.pop_back();
    KILN_TRY(const Affine local, local_transform(context, above.node));
    const PlacedNode at{above.node, above.to_world * local};
    if (!is_finite(at.to_world))
      return context.bad(text("{}: its transform is not finite", node_name(context, at.node)));
    if (!enter(at, above.to_world)) continue;
    const auto& children = context.model.nodes[at.node].children;
    for (auto child = children.rbegin(); child != children.rend(); ++child)
      open.push_back({static_cast<uint32_t>(*child), at.to_world});
  }
  return {};
}

}  // namespace kiln
