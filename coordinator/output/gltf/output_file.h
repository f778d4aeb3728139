// The input file on its way to being written again: its JSON, its one buffer, and meshes whose vertices are
// split at chart borders, once per set of charts (triangles that charts were cut through become several).
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "coordinator/output/gltf/buffer.h"
#include "coordinator/output/gltf/gltf.h"
#include "coordinator/scene/display/display.h"

namespace kiln {

constexpr const char* kKilnLightmap = "KILN_lightmap";

// Vertices of a mesh once each corner has the lightmap coordinates of its chart.
struct SplitMesh {
  std::vector<VertexBlend> source;  // by new vertex
  std::vector<uint32_t> indices;    // 3 per face
  std::vector<Vec2> chart_uv;       // by new vertex, before placement
  std::vector<uint32_t> chart;      // by new vertex
  nlohmann::json attributes;        // gathered accessors
  int index_accessor = -1;
};

// The instances (one a primitive) of one copy of a node's mesh, in the order of the scene.
using MeshCopy = std::vector<uint32_t>;

class GltfOutput {
 public:
  static Expected<GltfOutput> open(const OutputContext& context);

  // By node of the file: a node with EXT_mesh_gpu_instancing has several copies.
  // A proxy that no engine draws is not among them: it stays as it was.
  static std::map<uint32_t, std::vector<MeshCopy>> copies_by_node(const OutputContext& context);

  // Vertices of the file's primitive that `in` names, split at the borders of these charts of `mesh`.
  Expected<SplitMesh> split_faces(const Instance& in, const Mesh& mesh, const MeshCharts& charts);
  Expected<const SplitMesh*> split_mesh(uint32_t instance);
  // The file's primitive with the split mesh's vertices; no TEXCOORD_1 yet.
  Expected<nlohmann::json> split_primitive(uint32_t instance);
  nlohmann::json file_primitive(uint32_t instance) const;  // as the file has it
  nlohmann::json primitive_with(const Instance& in, const SplitMesh& split) const;
  // The primitive once for each page that its charts are on, marked with it; `placement` by new vertex.
  nlohmann::json by_page(const nlohmann::json& primitive, const SplitMesh& split,
                         const std::vector<uint32_t>& placement);
  // Levels and display meshes that were not baked: TEXCOORD_1 addresses the lightmap, whatever the file's
  // form.
  Status give_levels_their_meshes();
  // A mesh like that of the copy's with these primitives; its index. The first one takes the place of the
  // file's mesh, unless a node that is not baked shows that too.
  size_t add_mesh(const MeshCopy& copy, nlohmann::json primitives);
  bool is_repeated(uint32_t node) const;  // by EXT_mesh_gpu_instancing
  // Gives a copy of a repeated node a root node of its own; its index.
  size_t add_root_node(const MeshCopy& copy, size_t mesh);
  // Takes mesh and EXT_mesh_gpu_instancing from a node whose copies have nodes of their own.
  void empty_node(uint32_t node);
  // extras.kiln of any glTF object; extras that are no object are kept as extras.value.
  static nlohmann::json& note(nlohmann::json& object);
  void note_lightmap();

  // KILN_lightmap at the root and on every node that shows a marked primitive. `by_table`: coordinates of
  // primitives with _CHART are found by the chart table.
  void attach_kiln_lightmap(bool by_table);
  // On materials, of which primitives of other pages, and those that the map does not light, get copies:
  // MOZ_lightmap if settings ask for it, and occlusionTexture from a baked ambient occlusion where the
  // material has none of its own.
  Status attach_material_maps();
  // EPIC_lightmap_textures: one lightmap a page; a node whose mesh is on several pages gets a child for each.
  Status attach_epic_lightmap();

  // The whole as one .glb; `name` is for messages.
  Expected<Bytes> finish(const std::string& name);

  nlohmann::json doc;
  GltfBuffer buffer;

 private:
  explicit GltfOutput(const OutputContext& context) : c_(&context) {}

  // Moves the file's own TEXCOORD_1 away where textures of materials use it.
  void free_texcoord_1();
  void fill_texcoord_gaps();
  void drop_unused();

  const OutputContext* c_;
  nlohmann::json file_meshes_;           // as they were
  std::set<uint32_t> in_use_;            // places in doc["meshes"] that are not free
  std::map<uint32_t, SplitMesh> split_;  // by set of charts
};

// The scene with TEXCOORD_1 on the pages and every lit primitive marked: scene.glb but for its lightmaps.
Expected<GltfOutput> open_lit_scene(const OutputContext& context);

// Marks a primitive as lit by a page: its TEXCOORD_1 is on it.
void mark_page(nlohmann::json& primitive, uint32_t page);
// Adds to extensionsUsed; takes an extension away from every object that may have it here.
void use_extension(nlohmann::json& doc, const char* name);
void drop_extension(nlohmann::json& doc, const char* name);

// Factor of radiance under which a mid grey surface in the light of the median texel looks mid grey.
float viewing_exposure(const OutputContext& context);

// Runs a writer and publishes its bytes as `name`. A file that import read, in a shape that we did not
// expect, is an error and not an exception.
Expected<std::vector<std::string>> publish_glb(const OutputContext& context, const std::string& name,
                                               Expected<Bytes> (*write)(const OutputContext&));

}  // namespace kiln
