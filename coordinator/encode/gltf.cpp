// scene.glb: the input file with TEXCOORD_1 that addresses the lightmap, as one self-contained file.
// In layout atlas the file's own TEXCOORD_1 is that already. In layout pack vertices are split at chart
// borders, once per set of charts (triangles that charts were cut through become several); every instance
// gets a mesh of its own whose TEXCOORD_1 is new and whose other data is shared with the other instances.
// Levels and display meshes that were not baked get meshes with projected coordinates, in either layout.
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/encode/gltf_buffer.h"
#include "coordinator/encode/output.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

// Vertices of a mesh once each corner has the lightmap coordinates of its chart.
struct SplitMesh {
  std::vector<VertexBlend> source;  // by new vertex
  std::vector<uint32_t> indices;    // 3 per face
  std::vector<Vec2> chart_uv;       // by new vertex, before placement
  std::vector<uint32_t> chart;      // by new vertex
  Json attributes;                  // gathered accessors
  int index_accessor = -1;
};

class GltfWriter {
 public:
  explicit GltfWriter(const OutputContext& c) : c_(c) {}

  Expected<Bytes> write() {
    doc_ = Json::parse(c_.document.json, nullptr, false);
    if (doc_.is_discarded() || !doc_.is_object())
      return fail(ErrorKind::kInvalidInput, text("{}: its JSON does not parse", c_.document.path.string()));
    KILN_TRY(GltfBuffer buffer, GltfBuffer::merge(doc_, c_.document));
    buffer_ = std::move(buffer);
    KILN_TRY_STATUS(buffer_.embed_images(doc_, c_.document.path.parent_path()));
    if (c_.atlas.packed) KILN_TRY_STATUS(give_instances_their_meshes());
    if (c_.display) KILN_TRY_STATUS(give_levels_their_meshes());
    add_lightmap_note();
    Bytes bytes = buffer_.take(doc_);
    const std::string json = doc_.dump();
    if (uint64_t{json.size()} + bytes.size() > (uint64_t{1} << 32) - 64)
      return fail(ErrorKind::kInvalidInput,
                  text("scene.glb would have {} MiB, and a GLB ends at 4 GiB: split the scene",
                       (json.size() + bytes.size()) >> 20));
    return write_glb(json, bytes);
  }

 private:
  Status give_instances_their_meshes();
  Status give_levels_their_meshes();
  Expected<SplitMesh> split_faces(const Instance& in, const Mesh& mesh, const MeshCharts& charts);
  Expected<SplitMesh*> split_mesh(uint32_t instance);
  Expected<Json> primitive_of(uint32_t instance);
  // The file's primitive with the vertices of `s`, whose charts are these placements.
  Json lit_primitive(const Instance& in, const SplitMesh& s, const std::vector<Vec2>& uv,
                     const std::vector<uint32_t>& placement_of_vertex);
  void add_lightmap_note();

  const OutputContext& c_;
  Json doc_;
  GltfBuffer buffer_;
  std::map<uint32_t, SplitMesh> split_;  // by set of charts
};

// Groups the instances of a node and file mesh; each group becomes one glTF mesh.
Status GltfWriter::give_instances_their_meshes() {
  std::map<uint32_t, std::vector<std::vector<uint32_t>>> by_node;  // node -> copies -> instances (primitives)
  for (uint32_t i = 0; i < c_.scene.instances.size(); ++i) {
    if (c_.display && !c_.display->is_drawn(i)) continue;  // a proxy stays as it was
    auto& copies = by_node[c_.scene.instances[i].node];
    const auto has = [&](const std::vector<uint32_t>& copy) {
      for (uint32_t other : copy)
        if (c_.scene.instances[other].file_primitive == c_.scene.instances[i].file_primitive) return true;
      return false;
    };
    // The importer lists the primitives of a copy together: a repeated primitive begins the next copy.
    if (copies.empty() || has(copies.back())) copies.emplace_back();
    copies.back().push_back(i);
  }
  const Json meshes = doc_["meshes"];
  for (const auto& [node, copies] : by_node) {
    Json& file_node = doc_["nodes"][node];
    const bool repeated =
        file_node.contains("extensions") && file_node["extensions"].contains("EXT_mesh_gpu_instancing");
    for (const auto& copy : copies) {
      Json mesh = meshes[c_.scene.instances[copy.front()].file_mesh];
      Json primitives = Json::array();
      for (uint32_t i : copy) {
        KILN_TRY(Json primitive, primitive_of(i));
        primitives.push_back(std::move(primitive));
      }
      mesh["primitives"] = std::move(primitives);
      const size_t index = doc_["meshes"].size();
      doc_["meshes"].push_back(std::move(mesh));
      if (!repeated) {
        doc_["nodes"][node]["mesh"] = index;
        continue;
      }
      // Instances of EXT_mesh_gpu_instancing cannot differ in coordinates: each becomes a root node.
      const Mat4x3& m = c_.scene.instances[copy.front()].to_world;
      Json matrix = Json::array();
      for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
          matrix.push_back(row < 3 ? double{m[column][row]} : column == 3 ? 1.0 : 0.0);
      const size_t child = doc_["nodes"].size();
      doc_["nodes"].push_back(
          {{"mesh", index}, {"matrix", matrix}, {"name", c_.scene.instances[copy.front()].name}});
      const size_t scene = doc_.value("scene", 0);
      doc_["scenes"][scene]["nodes"].push_back(child);
    }
    if (repeated) {
      Json& n = doc_["nodes"][node];
      n.erase("mesh");
      n["extensions"].erase("EXT_mesh_gpu_instancing");
      if (n["extensions"].empty()) n.erase("extensions");
    }
  }
  return {};
}

// Corner `k` of a face in terms of the file's vertices at the corners of its triangle.
VertexBlend blend_of(const MeshCharts& charts, size_t face, int k, const uint32_t* corner) {
  if (charts.parts.empty()) return {{corner[k], 0, 0}, {1, 0, 0}};
  const Vec2& b = charts.parts[face].corner[k];
  const float weight[3] = {1.0f - b.x - b.y, b.x, b.y};
  VertexBlend blend{{0, 0, 0}, {0, 0, 0}};
  int used = 0;
  for (int c = 0; c < 3; ++c)
    if (weight[c] > 0) {
      blend.vertex[used] = corner[c];
      blend.weight[used++] = weight[c];
    }
  return blend;
}

Expected<SplitMesh> GltfWriter::split_faces(const Instance& in, const Mesh& mesh, const MeshCharts& charts) {
  SplitMesh s;
  const Json primitive = doc_["meshes"][in.file_mesh]["primitives"][in.file_primitive];
  KILN_TRY(const std::vector<uint32_t> corners, buffer_.triangle_corners(doc_, primitive));
  struct Key {
    VertexBlend vertex;
    uint32_t chart;
    float u, v;
    auto operator<=>(const Key&) const = default;
  };
  std::map<Key, uint32_t> made;
  for (size_t f = 0; f < charts.face_count(); ++f) {
    const size_t first = 3 * size_t{mesh.source_triangle[charts.triangle_of(f)]};
    if (first + 2 >= corners.size())
      return fail(ErrorKind::kInternal, text("mesh '{}' lost a triangle of the file", mesh.name));
    for (int c = 0; c < 3; ++c) {
      const VertexBlend vertex = blend_of(charts, f, c, &corners[first]);
      const Vec2 uv = charts.corner_uv[3 * f + c];
      const auto [it, added] = made.try_emplace({vertex, charts.chart_of_face[f], uv.x, uv.y},
                                                static_cast<uint32_t>(s.source.size()));
      if (added) {
        s.source.push_back(vertex);
        s.chart_uv.push_back(uv);
        s.chart.push_back(charts.chart_of_face[f]);
      }
      s.indices.push_back(it->second);
    }
  }
  KILN_TRY(s.attributes, buffer_.gather_attributes(doc_, primitive["attributes"], s.source));
  s.index_accessor = buffer_.add_indices(doc_, s.indices);
  return s;
}

Expected<SplitMesh*> GltfWriter::split_mesh(uint32_t instance) {
  const Instance& in = c_.scene.instances[instance];
  const uint32_t set = c_.atlas.charts_of_instance[instance];
  if (const auto it = split_.find(set); it != split_.end()) return &it->second;
  KILN_TRY(SplitMesh s, split_faces(in, c_.scene.meshes[in.mesh], c_.atlas.charts[set]));
  return &split_.emplace(set, std::move(s)).first->second;
}

Expected<Json> GltfWriter::primitive_of(uint32_t instance) {
  KILN_TRY(SplitMesh * s, split_mesh(instance));
  std::vector<Vec2> uv(s->source.size());
  std::vector<uint32_t> placement(uv.size());
  for (size_t v = 0; v < uv.size(); ++v) {
    placement[v] = c_.atlas.instance_first_chart[instance] + s->chart[v];
    const Vec2 texels(c_.atlas.placements[placement[v]].to_texels(DVec2(s->chart_uv[v])));
    uv[v] = texels / Vec2(c_.atlas.width, c_.atlas.height);
  }
  return lit_primitive(c_.scene.instances[instance], *s, uv, placement);
}

Json GltfWriter::lit_primitive(const Instance& in, const SplitMesh& s, const std::vector<Vec2>& uv,
                               const std::vector<uint32_t>& placement_of_vertex) {
  Json primitive = doc_["meshes"][in.file_mesh]["primitives"][in.file_primitive];
  primitive["attributes"] = s.attributes;
  primitive["attributes"]["TEXCOORD_1"] = buffer_.add_texcoords(doc_, uv);
  primitive["indices"] = s.index_accessor;
  primitive["mode"] = 4;
  // Morph targets index the file's vertices; a bake has frozen the base pose.
  primitive.erase("targets");
  if (c_.atlas.pages > 1 && !placement_of_vertex.empty()) {
    // Pages of this primitive's charts, in the order of first use.
    Json pages = Json::array();
    for (const uint32_t placement : placement_of_vertex) {
      const uint32_t page = c_.atlas.placements[placement].page;
      if (std::find(pages.begin(), pages.end(), Json(page)) == pages.end()) pages.push_back(page);
    }
    primitive["extras"]["kiln"]["pages"] = pages;
  }
  return primitive;
}

Status GltfWriter::give_levels_their_meshes() {
  std::map<uint32_t, std::vector<uint32_t>> by_node;  // display meshes: primitives of the node's mesh
  for (uint32_t i = 0; i < c_.display->shown.size(); ++i)
    by_node[c_.display->shown[i].place.node].push_back(i);
  for (const auto& [node, shown] : by_node) {
    Json mesh = doc_["meshes"][c_.display->shown[shown.front()].place.file_mesh];
    Json primitives = Json::array();
    for (const uint32_t i : shown) {
      const Instance& in = c_.display->shown[i].place;
      const ProjectedCharts& projected = c_.projection->charts[i];
      KILN_TRY(const SplitMesh s, split_faces(in, c_.display->meshes[in.mesh], projected.charts));
      std::vector<Vec2> uv;
      std::vector<uint32_t> placement;
      for (size_t v = 0; v < s.source.size(); ++v) {
        uv.push_back(s.chart_uv[v] / Vec2(c_.atlas.width, c_.atlas.height));
        placement.push_back(projected.placement[s.chart[v]]);
      }
      primitives.push_back(lit_primitive(in, s, uv, placement));
    }
    mesh["primitives"] = std::move(primitives);
    doc_["nodes"][node]["mesh"] = doc_["meshes"].size();
    doc_["meshes"].push_back(std::move(mesh));
  }
  return {};
}

void GltfWriter::add_lightmap_note() {
  Json files = Json::array();
  for (uint32_t page = 0; page < c_.atlas.pages; ++page)
    files.push_back(page_name("irradiance", "exr", page, c_.atlas.pages));
  doc_["extras"]["kiln"] = {{"version", 1},
                            {"lightmap", files},
                            {"texcoord", 1},
                            {"quantity", "irradiance; a renderer shows base colour / pi x E"},
                            {"width", c_.atlas.width},
                            {"height", c_.atlas.height}};
  doc_["asset"]["generator"] = "Kiln";
}

}  // namespace

Expected<std::vector<std::string>> write_gltf(const OutputContext& c) {
  Expected<Bytes> glb = Bytes{};
  try {
    glb = GltfWriter(c).write();
  } catch (const nlohmann::json::exception& e) {  // a file that import read, in a shape we did not expect
    return fail(ErrorKind::kInternal, text("scene.glb: {}", e.what()));
  }
  if (!glb) return tl::unexpected<Error>(glb.error());
  KILN_TRY_STATUS(write_file_atomic(c.folder / "scene.glb", *glb));
  return std::vector<std::string>{"scene.glb"};
}

}  // namespace kiln
