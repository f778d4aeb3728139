// The input file on its way to being written again: its JSON, its one buffer, and meshes whose vertices are
// split at chart borders, once per set of charts (triangles that charts were cut through become several).
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "coordinator/display/display.h"
#include "coordinator/encode/gltf_buffer.h"
#include "coordinator/encode/output.h"

namespace kiln {

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
  nlohmann::json primitive_with(const Instance& in, const SplitMesh& split) const;
  // In extras.kiln.pages, where there are several: pages of these placements in the order of first use.
  void note_pages(nlohmann::json& primitive, const std::vector<uint32_t>& placements) const;
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

  // The whole as one .glb; `name` is for messages.
  Expected<Bytes> finish(const std::string& name);

  nlohmann::json doc;
  GltfBuffer buffer;

 private:
  explicit GltfOutput(const OutputContext& context) : c_(&context) {}

  const OutputContext* c_;
  nlohmann::json file_meshes_;           // as they were
  std::set<uint32_t> in_use_;            // places in doc["meshes"] that are not free
  std::map<uint32_t, SplitMesh> split_;  // by set of charts
};

// Runs a writer and publishes its bytes as `name`. A file that import read, in a shape that we did not
// expect, is an error and not an exception.
Expected<std::vector<std::string>> publish_glb(const OutputContext& context, const std::string& name,
                                               Expected<Bytes> (*write)(const OutputContext&));

}  // namespace kiln
