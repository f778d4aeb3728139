// scene.glb: the input file with TEXCOORD_1 that addresses the lightmap, as one self-contained file.
// In layout atlas the file's own TEXCOORD_1 is that already. In layout pack every instance gets its own mesh
// with a new TEXCOORD_1; the other data is shared between instances. Levels and display meshes that were not
// baked get meshes with projected coordinates, in either layout.
#include "coordinator/output/gltf/output_file.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

// The primitive of an instance, once per page.
Expected<Json> primitives_of(const OutputContext& c, GltfOutput& scene, uint32_t instance) {
  if (!c.atlas.receives(instance)) return Json::array({scene.file_primitive(instance)});
  KILN_TRY(Json primitive, scene.split_primitive(instance));
  KILN_TRY(const SplitMesh* s, scene.split_mesh(instance));
  const ChartPlacement* places = &c.atlas.placements[c.atlas.instance_first_chart[instance]];
  std::vector<Vec2> uv(s->source.size());
  for (size_t v = 0; v < uv.size(); ++v) {
    const Vec2 texels(places[s->chart[v]].to_texels(DVec2(s->chart_uv[v])));
    uv[v] = texels / Vec2(c.atlas.width, c.atlas.height);
  }
  primitive["attributes"]["TEXCOORD_1"] = scene.buffer.add_texcoords(scene.doc, uv);
  std::vector<uint32_t> placement;
  for (const uint32_t chart : s->chart) placement.push_back(c.atlas.instance_first_chart[instance] + chart);
  return scene.by_page(primitive, *s, placement);
}

Status give_instances_their_meshes(const OutputContext& c, GltfOutput& scene) {
  for (const auto& [node, copies] : GltfOutput::copies_by_node(c)) {
    const bool repeated = scene.is_repeated(node);
    for (const MeshCopy& copy : copies) {
      Json primitives = Json::array();
      for (const uint32_t i : copy) {
        KILN_TRY(const Json parts, primitives_of(c, scene, i));
        primitives.insert(primitives.end(), parts.begin(), parts.end());
      }
      const size_t mesh = scene.add_mesh(copy, std::move(primitives));
      // Instances of EXT_mesh_gpu_instancing cannot differ in coordinates: each becomes a root node.
      if (repeated)
        scene.add_root_node(copy, mesh);
      else
        scene.doc["nodes"][node]["mesh"] = mesh;
    }
    if (repeated) scene.empty_node(node);
  }
  return {};
}

// Layout atlas: meshes stay unchanged. If only some copies of a mesh receive light, the others get their own
// mesh without the lightmap.
void mark_instances(const OutputContext& c, GltfOutput& scene) {
  const auto& instances = c.scene.instances;
  for (uint32_t i = 0; i < instances.size(); ++i)
    if (c.atlas.receives(i))
      mark_page(scene.doc["meshes"][instances[i].file_mesh]["primitives"][instances[i].file_primitive], 0);
  for (const auto& [node, copies] : GltfOutput::copies_by_node(c)) {
    if (scene.is_repeated(node)) continue;
    Json mesh = scene.doc["meshes"][instances[copies.front().front()].file_mesh];
    bool differs = false;
    for (const uint32_t i : copies.front()) {
      if (c.atlas.receives(i)) continue;
      Json& primitive = mesh["primitives"][instances[i].file_primitive];
      differs |= primitive.contains("extensions") && primitive["extensions"].contains(kKilnLightmap);
      primitive = scene.file_primitive(i);
    }
    if (!differs) continue;
    scene.doc["nodes"][node]["mesh"] = scene.doc["meshes"].size();
    scene.doc["meshes"].push_back(std::move(mesh));
  }
}

Expected<Bytes> write(const OutputContext& c) {
  KILN_TRY(GltfOutput scene, open_lit_scene(c));
  scene.note_lightmap();
  scene.treat_lamps();
  scene.attach_kiln_lightmap(false);
  scene.attach_kiln_probes();
  const GltfLightmaps& which = c.settings.gltf_lightmap;
  KILN_TRY_STATUS(scene.attach_material_maps());
  KILN_TRY_STATUS(scene.attach_node_lightmaps());
  if (!which.kiln) drop_extension(scene.doc, kKilnLightmap);
  return scene.finish("scene.glb");
}

Expected<Bytes> write_probes_alone(const OutputContext& c) {
  KILN_TRY(GltfOutput scene, GltfOutput::open(c));
  scene.note_no_lightmap();
  scene.attach_kiln_probes();
  return scene.finish("scene.glb");
}

}  // namespace

Expected<GltfOutput> open_lit_scene(const OutputContext& c) {
  KILN_TRY(GltfOutput scene, GltfOutput::open(c));
  if (c.atlas.packed) {
    KILN_TRY_STATUS(give_instances_their_meshes(c, scene));
  } else {
    mark_instances(c, scene);
  }
  KILN_TRY_STATUS(scene.give_levels_their_meshes());
  return scene;
}

Expected<std::vector<std::string>> write_gltf(const OutputContext& c) {
  return publish_glb(c, "scene.glb", write);
}

Expected<std::vector<std::string>> write_gltf_of_probes(const OutputContext& c) {
  return publish_glb(c, "scene.glb", write_probes_alone);
}

}  // namespace kiln
