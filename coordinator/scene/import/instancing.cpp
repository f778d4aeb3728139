#include "coordinator/scene/import/instancing.h"

#include "common/base/format.h"
#include "coordinator/scene/import/accessors.h"

namespace kiln {
namespace {

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

struct InstanceArrays {
  FloatArray translation, rotation, scale;  // empty where absent
  size_t count = 0;
};

Status read_array(const ImportContext& context, uint32_t node, const GltfValue& attributes, const char* name,
                  uint32_t components, FloatArray& out, std::optional<size_t>& count) {
  if (!attributes.find(name)) return {};
  const std::string who = text("{}: {} {}", node_name(context, node), kInstancing, name);
  auto read = read_floats(context, attributes.index(name));
  if (!read) return fail(read.error().kind, text("{} ({})", read.error().message, who));
  if (read->components != components) return context.bad(text("{} has {} components", who, read->components));
  if (count && read->size() != *count)
    return context.bad(text("{} has {} elements, another attribute {}", who, read->size(), *count));
  for (size_t i = 0; i < read->values.size(); ++i)
    if (!std::isfinite(read->values[i]))
      return context.bad(text("{}: instance {} is not finite", who, i / components));
  count = read->size();
  out = std::move(*read);
  return {};
}

Expected<InstanceArrays> read_arrays(const ImportContext& context, uint32_t node,
                                     const GltfValue& extension) {
  InstanceArrays arrays;
  const GltfValue* attributes = extension.find("attributes");
  if (!attributes)
    return context.bad(text("{}: {} has no attributes", node_name(context, node), kInstancing));
  std::optional<size_t> count;
  KILN_TRY_STATUS(read_array(context, node, *attributes, "TRANSLATION", 3, arrays.translation, count));
  KILN_TRY_STATUS(read_array(context, node, *attributes, "ROTATION", 4, arrays.rotation, count));
  KILN_TRY_STATUS(read_array(context, node, *attributes, "SCALE", 3, arrays.scale, count));
  if (!count) return context.bad(text("{}: {} places nothing", node_name(context, node), kInstancing));
  arrays.count = *count;
  return arrays;
}

DVec3 vector_at(const FloatArray& array, size_t i, const DVec3& otherwise) {
  const auto& v = array.values;
  return v.empty() ? otherwise : DVec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
}

Affine instance_transform(const InstanceArrays& arrays, size_t i) {
  double q[4] = {0, 0, 0, 1};
  if (!arrays.rotation.values.empty())
    for (size_t c = 0; c < 4; ++c) q[c] = arrays.rotation.values[4 * i + c];
  return from_trs(vector_at(arrays.translation, i, DVec3(0)), q, vector_at(arrays.scale, i, DVec3(1)));
}

}  // namespace

Expected<std::vector<MeshPlace>> place_meshes(const ImportContext& context,
                                              const std::vector<PlacedNode>& nodes, uint32_t group,
                                              ImportNotes& notes) {
  std::vector<MeshPlace> places;
  Finding singular, skinned;
  const auto place = [&](uint32_t node, uint32_t mesh, const Affine& to_world) -> Status {
    if (!is_finite(to_world))
      return context.bad(text("{}: an instance's transform is not finite", node_name(context, node)));
    if (is_singular(to_world))
      singular.add(node_name(context, node));
    else
      places.push_back({node, mesh, to_world, group});
    return {};
  };
  for (const PlacedNode& at : nodes) {
    const GltfNode& node = context.model.nodes[at.node];
    if (node.mesh < 0) continue;
    const auto mesh = static_cast<uint32_t>(node.mesh);
    if (mesh >= context.model.meshes.size())
      return context.bad(text("{}: mesh {} does not exist, there are {}", node_name(context, at.node),
                              node.mesh, context.model.meshes.size()));
    if (node.skin >= 0) skinned.add(node_name(context, at.node));
    const auto extension = node.extensions.find(kInstancing);
    if (extension == node.extensions.end()) {
      KILN_TRY_STATUS(place(at.node, mesh, at.to_world));
      continue;
    }
    KILN_TRY(const InstanceArrays arrays, read_arrays(context, at.node, extension->second));
    KILN_TRY_STATUS(context.document.budget->take(arrays.count * 2 * sizeof(MeshPlace),
                                                  "the places of EXT_mesh_gpu_instancing"));
    for (size_t i = 0; i < arrays.count; ++i)
      KILN_TRY_STATUS(place(at.node, mesh, at.to_world * instance_transform(arrays, i)));
  }
  if (!singular.empty())
    add_note(notes, ImportNote::Kind::kNote,
             text("a singular transform (a scale of 0?) leaves nothing to bake of {}",
                  singular.list("place", "places")));
  if (!skinned.empty())
    add_note(notes, ImportNote::Kind::kApproximated,
             text("skins are left out: the base pose is baked, in {}", skinned.list("node", "nodes")));
  return places;
}

}  // namespace kiln
