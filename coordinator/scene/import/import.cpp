#include "coordinator/scene/import/import.h"

#include <algorithm>
#include <map>

#include "common/base/format.h"
#include "common/scene/prepared.h"
#include "common/scene/scale.h"
#include "coordinator/scene/density/density.h"
#include "coordinator/scene/import/area_lights.h"
#include "coordinator/scene/import/blender_units.h"
#include "coordinator/scene/import/compressed.h"
#include "coordinator/scene/import/density_extras.h"
#include "coordinator/scene/import/display_meshes.h"
#include "coordinator/scene/import/environment.h"
#include "coordinator/scene/import/extensions.h"
#include "coordinator/scene/import/ies_lights.h"
#include "coordinator/scene/import/instancing.h"
#include "coordinator/scene/import/levels.h"
#include "coordinator/scene/import/lights.h"
#include "coordinator/scene/import/materials.h"
#include "coordinator/scene/import/meshes.h"
#include "coordinator/scene/import/part_extras.h"
#include "coordinator/scene/import/probe_extras.h"
#include "coordinator/scene/import/texture_density.h"

namespace kiln {
namespace {

using Kind = ImportNote::Kind;

// The primitives and materials in use, each once, in file order; glTF's default material (-1) comes last.
struct Used {
  std::vector<PrimitiveRequest> primitives;
  std::vector<int> materials;
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> primitive_slot;  // (mesh, primitive) to primitives
  std::map<int, uint32_t> material_slot;
};

Expected<Used> find_used(const ImportContext& context, const std::vector<MeshPlace>& places) {
  std::vector<bool> mesh_used(context.model.meshes.size(), false);
  for (const MeshPlace& place : places) mesh_used[place.mesh] = true;
  Used used;
  for (uint32_t m = 0; m < mesh_used.size(); ++m) {
    if (!mesh_used[m]) continue;
    const auto& primitives = context.model.meshes[m].primitives;
    for (uint32_t p = 0; p < primitives.size(); ++p) {
      const int material = primitives[p].material;
      if (material < -1 || material >= static_cast<int>(context.model.materials.size()))
        return context.bad(text("{} primitive {}: material {} does not exist, there are {}",
                                element("mesh", m, context.model.meshes[m].name), p, material,
                                context.model.materials.size()));
      used.primitive_slot[{m, p}] = static_cast<uint32_t>(used.primitives.size());
      used.primitives.push_back({m, p, false});
      used.materials.push_back(material);
    }
  }
  const auto order = [](int a, int b) { return static_cast<unsigned>(a) < static_cast<unsigned>(b); };
  std::sort(used.materials.begin(), used.materials.end(), order);
  used.materials.erase(std::unique(used.materials.begin(), used.materials.end()), used.materials.end());
  for (const int m : used.materials)
    used.material_slot.emplace(m, static_cast<uint32_t>(used.material_slot.size()));
  return used;
}

Status read_materials(const ImportContext& context, Used& used, Scene& scene, ImportNotes& notes) {
  TextureSet textures;
  for (const int material : used.materials)
    scene.materials.push_back(read_material(context, material, textures, notes));
  KILN_TRY(scene.textures, textures.decode(context, notes));
  for (Record& material : scene.materials) resolve_textures(material, textures);
  for (PrimitiveRequest& request : used.primitives) {
    const int material = context.model.meshes[request.mesh].primitives[request.primitive].material;
    request.keep_uv0 = uses_uv_set(scene.materials[used.material_slot.at(material)], 0);
  }
  return {};
}

Status place_instances(const ImportContext& context, const std::vector<MeshPlace>& places, const Used& used,
                       std::vector<PrimitiveResult> primitives, Scene& scene,
                       std::vector<uint32_t>& group_of_instance) {
  std::vector<int64_t> mesh_of(primitives.size(), -1);
  std::vector<MeshBounds> bounds;
  for (size_t i = 0; i < primitives.size(); ++i) {
    if (primitives[i].mesh.triangles.empty()) continue;
    mesh_of[i] = static_cast<int64_t>(scene.meshes.size());
    bounds.emplace_back(primitives[i].mesh);
    scene.meshes.push_back(std::move(primitives[i].mesh));
  }
  for (const MeshPlace& place : places) {
    const auto& file_primitives = context.model.meshes[place.mesh].primitives;
    for (uint32_t p = 0; p < file_primitives.size(); ++p) {
      const int64_t found = mesh_of[used.primitive_slot.at({place.mesh, p})];
      if (found < 0) continue;
      const auto mesh = static_cast<uint32_t>(found);
      KILN_TRY_STATUS(check_extent(context, place, scene.meshes[mesh], bounds[mesh]));
      KILN_TRY_STATUS(take_instance(context, place, scene.meshes[mesh]));
      scene.instances.push_back(instance_of(context, place, p, mesh));
      scene.instances.back().material = used.material_slot.at(file_primitives[p].material);
      group_of_instance.push_back(place.group);
    }
  }
  if (scene.instances.empty()) return context.bad("the scene has no triangles to bake");
  return {};
}

// Drops materials whose primitives are all empty, so that they are not sent.
void drop_unused_materials(Scene& scene) {
  std::vector<bool> in_use(scene.materials.size(), false);
  for (const Instance& i : scene.instances) in_use[i.material] = true;
  std::vector<uint32_t> to(scene.materials.size(), 0);
  std::vector<Record> kept;
  for (size_t m = 0; m < in_use.size(); ++m) {
    to[m] = static_cast<uint32_t>(kept.size());
    if (in_use[m]) kept.push_back(std::move(scene.materials[m]));
  }
  scene.materials = std::move(kept);
  for (Instance& i : scene.instances) i.material = to[i.material];
}

void add_lamps(std::vector<PlacedLight> lights, Scene& scene, Display& display) {
  for (PlacedLight& light : lights) {
    const Property* bake = light.record.find("bake");
    display.lamps.push_back({light.node, light.record.name, light.record.type, bake && bake->word == "full"});
    scene.lights.push_back(std::move(light.record));
  }
}

Status read_all_lights(const ImportContext& context, const std::vector<PlacedNode>& nodes, Scene& scene,
                       Display& display, ImportNotes& notes) {
  KILN_TRY(std::vector<PlacedLight> lamps, read_lights(context, nodes, notes));
  add_lamps(std::move(lamps), scene, display);
  KILN_TRY(std::vector<PlacedLight> profiles, read_ies_lights(context, nodes, scene.textures, notes));
  add_lamps(std::move(profiles), scene, display);
  KILN_TRY(std::vector<PlacedLight> areas, read_area_lights(context, nodes));
  add_lamps(std::move(areas), scene, display);
  for (Record& sun : sun_lights(context.settings)) scene.lights.push_back(std::move(sun));
  KILN_TRY(std::optional<Record> environment, read_environment_light(context, scene.textures, notes));
  if (environment) scene.lights.push_back(std::move(*environment));
  const bool emissive = std::any_of(scene.materials.begin(), scene.materials.end(), emits);
  if (scene.lights.empty() && !emissive && context.settings.quantities.light)
    add_note(
        notes, Kind::kWarning,
        text("{}: there is no light: no lamp, no emissive material, no environment. The map will be black; "
             "--environment or --sun adds one",
             context.document.path.string()));
  return {};
}

// Cameras serve as viewpoints of previews and may control density.
Status read_cameras(const ImportContext& context, const std::vector<PlacedNode>& nodes,
                    ImportResult& result) {
  constexpr uint64_t kCamera = 256;
  for (const PlacedNode& at : nodes) {
    const int index = context.model.nodes[at.node].camera;
    if (index < 0 || static_cast<size_t>(index) >= context.model.cameras.size()) continue;
    const GltfCamera& file = context.model.cameras[static_cast<size_t>(index)];
    Camera camera;
    if (!file.perspective || !(file.vertical_fov > 0 && file.vertical_fov < 3.14)) continue;
    if (!rigid_part(at.to_world, camera.to_world)) continue;
    camera.vertical_fov = static_cast<float>(file.vertical_fov);
    camera.name = !file.name.empty() ? file.name : context.model.nodes[at.node].name;
    Viewpoint viewpoint{camera.to_world, camera.vertical_fov};
    if (file.aspect >= 1e-2 && file.aspect <= 1e2) viewpoint.aspect = static_cast<float>(file.aspect);
    result.density.cameras.push_back(viewpoint);
    if (camera.name.empty()) camera.name = text("camera {}", index);
    KILN_TRY_STATUS(context.document.budget->take(kCamera + camera.name.size(), "its cameras"));
    result.cameras.push_back(std::move(camera));
  }
  return {};
}

// The file's own atlas has no density.
void note_scale(const Scene& scene, const BakeSettings& settings, ImportNotes& notes) {
  const bool has_atlas = std::none_of(scene.meshes.begin(), scene.meshes.end(),
                                      [](const Mesh& mesh) { return mesh.uv[1].empty(); });
  if (settings.layout == "atlas" || (settings.layout != "pack" && has_atlas) || settings.max_texels) return;
  std::string doubt = doubt_density(measure_scale(scene), settings.texels_per_metre);
  if (!doubt.empty()) add_note(notes, Kind::kWarning, std::move(doubt));
}

}  // namespace

Expected<ImportResult> import_scene(const std::filesystem::path& path, const BakeSettings& settings) {
  ImportResult result;
  KILN_TRY(result.document, read_gltf_document(path, settings.variant));
  KILN_TRY_STATUS(check_compression(result.document));
  KILN_TRY(const GltfModel model, parse_gltf_model(result.document));
  const ImportContext context{result.document, model, settings};
  Scene& scene = result.scene;
  KILN_TRY_STATUS(check_extensions(context, result.notes));
  KILN_TRY(const Levels levels, read_levels(context, result.notes));
  const std::vector<PlacedNode>& nodes = levels.standing;
  std::vector<MeshPlace> places;
  for (uint32_t group = 0; group < levels.baked.size(); ++group) {
    KILN_TRY(const std::vector<MeshPlace> some,
             place_meshes(context, levels.baked[group], group, result.notes));
    places.insert(places.end(), some.begin(), some.end());
  }
  KILN_TRY(Used used, find_used(context, places));
  KILN_TRY_STATUS(read_materials(context, used, scene, result.notes));
  KILN_TRY(std::vector<PrimitiveResult> primitives, read_primitives(context, used.primitives));
  note_primitives(context, used.primitives, primitives, result.notes);
  std::vector<uint32_t> group_of_instance;
  KILN_TRY_STATUS(place_instances(context, places, used, std::move(primitives), scene, group_of_instance));
  KILN_TRY(result.display, read_display(context, levels, group_of_instance, result.notes));
  drop_unused_materials(scene);
  KILN_TRY_STATUS(read_parts(context, nodes, scene, result.notes));
  KILN_TRY(result.density, read_density(context, nodes, scene, result.notes));
  reduce_to_density(scene, settings, most_density_factor(result.density, settings), result.notes);
  KILN_TRY_STATUS(read_all_lights(context, nodes, scene, result.display, result.notes));
  warn_of_lumens(context, scene, result.notes);
  KILN_TRY_STATUS(read_cameras(context, nodes, result));
  note_scale(scene, settings, result.notes);
  KILN_TRY(result.probes, read_probe_boxes(context, nodes, result.notes));
  if (auto checked = check_scene(scene); !checked) return context.bad(checked.error().message);
  return result;
}

}  // namespace kiln
