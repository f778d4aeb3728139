// scene_instanced.glb: the input file with each mesh stored once. Its TEXCOORD_1 is in the chart's box,
// _CHART is the chart's number in the mesh, and a node gives its first entry in the table of charts.bin:
// extras.kiln.first_chart, or by instance _FIRST_CHART of EXT_mesh_gpu_instancing. Instances cut at contacts
// have their own charts and so their own mesh.
#include <algorithm>

#include "common/base/format.h"
#include "coordinator/output/chart_table/chart_table.h"
#include "coordinator/output/gltf/output_file.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";
// glTF 2.0, 3.7.2.1: application-specific attributes cannot be 32-bit integers. A float is exact up to here.
constexpr uint32_t kMaxChart = 1u << 24;

class InstancedWriter {
 public:
  InstancedWriter(const OutputContext& c, GltfOutput& scene) : c_(c), scene_(scene) {}

  Status write() {
    if (c_.atlas.placements.size() > kMaxChart)
      return fail(ErrorKind::kInvalidInput,
                  text("scene_instanced.glb numbers at most {} charts, this scene has {}: bake without "
                       "--instanced, or split the scene",
                       kMaxChart, c_.atlas.placements.size()));
    for (const auto& [node, copies] : GltfOutput::copies_by_node(c_)) {
      const bool repeated = scene_.is_repeated(node);
      KILN_TRY_STATUS(repeated ? place_repeated(node, copies) : place_once(node, copies.front()));
    }
    return {};
  }

 private:
  uint32_t first_chart(const MeshCopy& copy) const { return c_.atlas.instance_first_chart[copy.front()]; }

  Status place_once(uint32_t node, const MeshCopy& copy) {
    KILN_TRY(const size_t mesh, mesh_of(copy));
    Json& n = scene_.doc["nodes"][node];
    n["mesh"] = mesh;
    GltfOutput::note(n)["first_chart"] = first_chart(copy);
    return {};
  }

  // Copies of one mesh stay one node; those with their own charts become children next to it.
  Status place_repeated(uint32_t node, const std::vector<MeshCopy>& copies) {
    std::vector<size_t> mesh_of_copy, meshes;
    for (const MeshCopy& copy : copies) {
      KILN_TRY(const size_t mesh, mesh_of(copy));
      mesh_of_copy.push_back(mesh);
      if (std::find(meshes.begin(), meshes.end(), mesh) == meshes.end()) meshes.push_back(mesh);
    }
    const Json extension = scene_.doc["nodes"][node]["extensions"][kInstancing];
    const Json attributes = extension["attributes"];
    if (count_of(attributes) !=
        copies.size()) {  // a copy without extent was dropped, and which one is unknown
      for (size_t k = 0; k < copies.size(); ++k) {
        const size_t root = scene_.add_root_node(copies[k], mesh_of_copy[k]);
        GltfOutput::note(scene_.doc["nodes"][root])["first_chart"] = first_chart(copies[k]);
      }
      scene_.empty_node(node);
      return {};
    }
    for (const size_t mesh : meshes) {
      std::vector<VertexBlend> chosen;
      std::vector<float> first;
      for (uint32_t k = 0; k < copies.size(); ++k) {
        if (mesh_of_copy[k] != mesh) continue;
        chosen.push_back({{k, 0, 0}, {1, 0, 0}});
        first.push_back(static_cast<float>(first_chart(copies[k])));
      }
      Json made = extension;
      if (meshes.size() > 1) {
        KILN_TRY(made["attributes"], scene_.buffer.gather_attributes(scene_.doc, attributes, chosen));
      }
      made["attributes"]["_FIRST_CHART"] = scene_.buffer.add_scalars(scene_.doc, first);
      size_t target = node;
      if (mesh != meshes.front()) {
        target = scene_.doc["nodes"].size();
        scene_.doc["nodes"].push_back(Json::object());
        scene_.doc["nodes"][node]["children"].push_back(target);
      }
      scene_.doc["nodes"][target]["mesh"] = mesh;
      scene_.doc["nodes"][target]["extensions"][kInstancing] = std::move(made);
    }
    return {};
  }

  size_t count_of(const Json& attributes) const {
    for (const char* name : {"TRANSLATION", "ROTATION", "SCALE"})
      if (attributes.contains(name))
        return scene_.doc["accessors"].at(attributes[name].get<size_t>()).value("count", size_t{0});
    return 0;
  }

  // The mesh of a copy, created when its sets of charts first occur.
  Expected<size_t> mesh_of(const MeshCopy& copy) {
    std::vector<uint32_t> key{c_.scene.instances[copy.front()].file_mesh};
    for (const uint32_t i : copy) {
      key.push_back(c_.scene.instances[i].file_primitive);
      key.push_back(c_.atlas.charts_of_instance[i]);
      key.push_back(c_.atlas.instance_first_chart[i] - first_chart(copy));
    }
    if (const auto it = meshes_.find(key); it != meshes_.end()) return it->second;
    Json primitives = Json::array();
    for (const uint32_t i : copy) {
      // Charts of a copy's primitives are consecutive in the table, so one number locates them all.
      const uint32_t base = c_.atlas.instance_first_chart[i] - first_chart(copy);
      KILN_TRY(Json primitive, primitive_of(i, base));
      primitives.push_back(std::move(primitive));
    }
    const size_t mesh = scene_.add_mesh(copy, std::move(primitives));
    meshes_.emplace(std::move(key), mesh);
    return mesh;
  }

  Expected<Json> primitive_of(uint32_t instance, uint32_t base) {
    if (!c_.atlas.receives(instance)) return scene_.file_primitive(instance);
    KILN_TRY(Json primitive, scene_.split_primitive(instance));
    KILN_TRY(const SplitMesh* s, scene_.split_mesh(instance));
    const uint32_t set = c_.atlas.charts_of_instance[instance];
    if (!texcoords_.count(set)) {
      const std::vector<ChartBounds> bounds = chart_bounds(c_.atlas.charts[set]);
      std::vector<Vec2> uv(s->source.size());
      for (size_t v = 0; v < uv.size(); ++v) uv[v] = bounds[s->chart[v]].to_box(s->chart_uv[v]);
      texcoords_[set] = scene_.buffer.add_texcoords(scene_.doc, uv);
    }
    if (!charts_.count({set, base})) {
      std::vector<float> chart;
      for (const uint32_t number : s->chart) chart.push_back(static_cast<float>(base + number));
      charts_[{set, base}] = scene_.buffer.add_scalars(scene_.doc, chart);
    }
    primitive["attributes"]["TEXCOORD_1"] = texcoords_[set];
    primitive["attributes"]["_CHART"] = charts_[{set, base}];
    primitive["extensions"][kKilnLightmap] = {{"chartAttribute", "_CHART"}};
    return primitive;
  }

  const OutputContext& c_;
  GltfOutput& scene_;
  std::map<std::vector<uint32_t>, size_t> meshes_;       // by file mesh and sets of charts
  std::map<uint32_t, int> texcoords_;                    // accessors by set
  std::map<std::pair<uint32_t, uint32_t>, int> charts_;  // accessors by set and first number
};

Expected<Bytes> write(const OutputContext& c) {
  KILN_TRY(GltfOutput scene, GltfOutput::open(c));
  KILN_TRY_STATUS(InstancedWriter(c, scene).write());
  KILN_TRY_STATUS(scene.give_levels_their_meshes());
  scene.note_lightmap();
  scene.treat_lamps();
  Json& note = GltfOutput::note(scene.doc);
  note["charts"] = "charts.bin";
  note["texcoord_space"] = "chart";
  scene.attach_kiln_lightmap(true);
  scene.attach_kiln_probes();
  return scene.finish("scene_instanced.glb");
}

}  // namespace

Expected<std::vector<std::string>> write_gltf_instanced(const OutputContext& c) {
  if (!c.settings.instanced || !c.atlas.packed) return std::vector<std::string>{};
  return publish_glb(c, "scene_instanced.glb", write);
}

}  // namespace kiln
