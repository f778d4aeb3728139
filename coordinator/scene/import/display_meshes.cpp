#include "coordinator/scene/import/display_meshes.h"

#include <map>

#include "common/base/format.h"
#include "coordinator/scene/import/meshes.h"

namespace kiln {

MeshBounds::MeshBounds(const Mesh& mesh) {
  if (!mesh.positions.empty()) low = high = DVec3(mesh.positions[0]);
  for (const Vec3& p : mesh.positions) {
    low = glm::min(low, DVec3(p));
    high = glm::max(high, DVec3(p));
  }
}

Status check_extent(const ImportContext& context, const MeshPlace& place, const Mesh& mesh,
                    const MeshBounds& bounds) {
  constexpr double kFarthest = 1e15;
  const auto& [low, high] = bounds;
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 at = place.to_world.point(
        {corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y, corner & 4 ? high.z : low.z});
    if (!(std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}) < kFarthest))
      return context.bad(text("{}: mesh '{}' reaches more than {} m from the origin",
                              node_name(context, place.node), mesh.name, kFarthest));
  }
  return {};
}

Status take_instance(const ImportContext& context, const MeshPlace& place, const Mesh& mesh) {
  constexpr uint64_t kInstance = 512, kTriangle = 160;  // in the layout and the plan, measured
  return context.document.budget->take(
      kInstance + 2 * context.model.nodes[place.node].name.size() + kTriangle * mesh.triangles.size(),
      "its objects, counted wherever they stand,");
}

Instance instance_of(const ImportContext& context, const MeshPlace& place, uint32_t primitive,
                     uint32_t mesh) {
  Instance instance;
  instance.mesh = mesh;
  instance.to_world = to_float(place.to_world);
  const std::string& name = context.model.nodes[place.node].name;
  instance.name = name.empty() ? text("node {}", place.node) : name;
  instance.node = place.node;
  instance.file_mesh = place.mesh;
  instance.file_primitive = primitive;
  return instance;
}

Expected<Display> read_display(const ImportContext& context, const Levels& levels,
                               const std::vector<uint32_t>& group_of_instance, ImportNotes& notes) {
  Display display;
  display.sets = levels.sets;
  if (display.sets.empty()) return display;
  std::vector<std::vector<uint32_t>> instances(levels.baked.size());  // by group
  for (uint32_t i = 0; i < group_of_instance.size(); ++i) {
    instances[group_of_instance[i]].push_back(i);
    display.undrawn.push_back(levels.is_proxy[group_of_instance[i]]);
  }
  for (uint32_t set = 0; set < display.sets.size(); ++set)
    display.sets[set].sources = instances[levels.group_of_set[set]];
  // Each primitive once, in the order of its first use.
  struct Use {
    MeshPlace place;
    uint32_t set, level, primitive, request;
  };
  std::vector<Use> uses;
  std::vector<PrimitiveRequest> requests;
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> known;
  for (const LevelNode& node : levels.shown) {
    KILN_TRY(const std::vector<MeshPlace> places, place_meshes(context, {node.at}, 0, notes));
    for (const MeshPlace& place : places)
      for (uint32_t p = 0; p < context.model.meshes[place.mesh].primitives.size(); ++p) {
        const auto [at, added] = known.try_emplace({place.mesh, p}, static_cast<uint32_t>(requests.size()));
        if (added) requests.push_back({place.mesh, p, false});
        uses.push_back({place, node.set, node.level, p, at->second});
      }
  }
  KILN_TRY(std::vector<PrimitiveResult> primitives, read_primitives(context, requests));
  std::vector<MeshBounds> bounds;
  for (PrimitiveResult& p : primitives) {
    bounds.emplace_back(p.mesh);
    display.meshes.push_back(std::move(p.mesh));
  }
  for (const Use& use : uses) {
    const Mesh& mesh = display.meshes[use.request];
    if (mesh.triangles.empty()) continue;
    KILN_TRY_STATUS(check_extent(context, use.place, mesh, bounds[use.request]));
    KILN_TRY_STATUS(take_instance(context, use.place, mesh));
    if (display.sets[use.set].sources.empty())
      return context.bad(text("{}: there is no triangle to bake in its {}", display.sets[use.set].name,
                              display.sets[use.set].baked));
    display.shown.push_back(
        {instance_of(context, use.place, use.primitive, use.request), use.set, use.level});
  }
  return display;
}

}  // namespace kiln
