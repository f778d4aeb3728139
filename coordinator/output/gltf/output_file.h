// The input file being rewritten: its JSON, its single buffer, and meshes with vertices split at chart
// borders, once per set of charts (triangles cut by charts become several).
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "coordinator/output/gltf/buffer.h"
#include "coordinator/output/gltf/gltf.h"
#include "coordinator/scene/display/display.h"

namespace kiln {

constexpr const char* kKilnLightmap = "KILN_lightmap";
constexpr const char* kKilnProbes = "KILN_probes";

// A mesh whose vertices are split so that each lies in a single chart.
struct SplitMesh {
  std::vector<VertexBlend> source;  // by new vertex
  std::vector<uint32_t> indices;    // 3 per face
  std::vector<Vec2> chart_uv;       // by new vertex, before placement
  std::vector<uint32_t> chart;      // by new vertex
  nlohmann::json attributes;        // copied accessors
  int index_accessor = -1;
};

// The instances (one per primitive) of one copy of a node's mesh, in scene order.
using MeshCopy = std::vector<uint32_t>;

class GltfOutput {
 public:
  static Expected<GltfOutput> open(const OutputContext& context);

  // By node of the file: a node with EXT_mesh_gpu_instancing has several copies.
  // Proxies, which engines do not draw, are not included and stay unchanged.
  static std::map<uint32_t, std::vector<MeshCopy>> copies_by_node(const OutputContext& context);

  // Splits the vertices of the file's primitive that `in` refers to at the borders of the charts of `mesh`.
  Expected<SplitMesh> split_faces(const Instance& in, const Mesh& mesh, const MeshCharts& charts);
  Expected<const SplitMesh*> split_mesh(uint32_t instance);
  // Returns the file's primitive with the vertices of the split mesh; it has no TEXCOORD_1 yet.
  Expected<nlohmann::json> split_primitive(uint32_t instance);
  nlohmann::json file_primitive(uint32_t instance) const;  // as the file has it
  nlohmann::json primitive_with(const Instance& in, const SplitMesh& split) const;
  // Returns one primitive for each page that has charts of this one, marked with that page. `placement` is
  // indexed by new vertex.
  nlohmann::json by_page(const nlohmann::json& primitive, const SplitMesh& split,
                         const std::vector<uint32_t>& placement);
  // Gives levels of detail and display meshes that were not baked a TEXCOORD_1 that addresses the lightmap,
  // in the instanced form too.
  Status give_levels_their_meshes();
  // Adds a mesh that is like the copy's but has these primitives, and returns its index. The first such mesh
  // replaces the file's, unless a node that was not baked shows it too.
  size_t add_mesh(const MeshCopy& copy, nlohmann::json primitives);
  bool is_repeated(uint32_t node) const;  // by EXT_mesh_gpu_instancing
  // Gives a copy of a repeated node its own root node; returns its index.
  size_t add_root_node(const MeshCopy& copy, size_t mesh);
  // Removes mesh and EXT_mesh_gpu_instancing from a node whose copies have their own nodes.
  void empty_node(uint32_t node);
  // extras.kiln of any glTF object; extras that are not an object are kept as extras.value.
  static nlohmann::json& note(nlohmann::json& object);
  void note_lightmap();
  // Of a bake without one: removes what an earlier bake noted.
  void note_no_lightmap();
  // Removes, marks or keeps the lamps whose light is in the map, and records the choice for KILN_lightmap.
  void treat_lamps();
  // Removes every lamp and image-based light.
  void drop_lamps();
  // Removes materials that no primitive uses, the textures and images that only they use, and extensions that
  // are then unused. KHR_materials_unlit must be the only extension of materials.
  void drop_unused_materials();

  // KILN_lightmap at the root and on every node that shows a marked primitive. `by_table`: primitives with
  // _CHART get coordinates from the chart table.
  void attach_kiln_lightmap(bool by_table);
  // KILN_probes at the root and on a node for each volume: the one that asked for it, else one that stood for
  // a volume of an earlier bake, else a new one.
  void attach_kiln_probes();
  // Adds to materials, copied for primitives on other pages and for those without the lightmap: MOZ_lightmap
  // if the settings request it, and occlusionTexture from baked ambient occlusion if the material has none.
  Status attach_material_maps();
  // EPIC_lightmap_textures and MX_lightmap, as the settings request them: one lightmap per page; a node whose
  // mesh is on several pages gets a child for each.
  Status attach_node_lightmaps();

  // Returns the document and its buffer as one .glb; `name` is for messages.
  Expected<Bytes> finish(const std::string& name);

  nlohmann::json doc;
  GltfBuffer buffer;

 private:
  explicit GltfOutput(const OutputContext& context) : c_(&context) {}

  // The page of each node, so that it shows no other.
  std::vector<int> split_nodes_by_page();
  Status attach_epic_lightmap(const std::vector<int>& pages);
  Status attach_mx_lightmap(const std::vector<int>& pages);

  // Renumbers the file's own TEXCOORD_1 where textures of materials use it.
  void free_texcoord_1();
  void drop_earlier_probes();
  void fill_texcoord_gaps();
  void drop_unused();

  nlohmann::json lamps_;  // the value of `lamps` in KILN_lightmap
  const OutputContext* c_;
  std::vector<size_t> probe_nodes_;      // stood for volumes of an earlier bake, and nothing else
  nlohmann::json file_meshes_;           // as they were
  std::set<uint32_t> in_use_;            // occupied indices of doc["meshes"]
  std::map<uint32_t, SplitMesh> split_;  // by set of charts
};

// The scene with TEXCOORD_1 on the pages and every lit primitive marked: scene.glb without its lightmaps.
Expected<GltfOutput> open_lit_scene(const OutputContext& context);

// Marks a primitive as lit by a page: its TEXCOORD_1 is on it.
void mark_page(nlohmann::json& primitive, uint32_t page);
// Adds to extensionsUsed; removes an extension from every object that may have it here.
void use_extension(nlohmann::json& doc, const char* name);
void drop_extension(nlohmann::json& doc, const char* name);

// Whether lights and materials may be renumbered: not where animation pointers or unknown extensions may
// refer to them by number.
bool may_renumber(const nlohmann::json& doc);

// Exposure factor at which a mid grey surface lit by the median texel appears mid grey.
float viewing_exposure(const OutputContext& context);

// Runs a writer and publishes its bytes as `name`. JSON of an unexpected shape in a file that import accepted
// is an error, not an exception.
Expected<std::vector<std::string>> publish_glb(const OutputContext& context, const std::string& name,
                                               Expected<Bytes> (*write)(const OutputContext&));

}  // namespace kiln
