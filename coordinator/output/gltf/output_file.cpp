#include "coordinator/output/gltf/output_file.h"

#include "common/base/files.h"
#include "common/base/format.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

// Corner `k` of a face as a blend of the file's vertices at its triangle's corners.
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

}  // namespace

Expected<GltfOutput> GltfOutput::open(const OutputContext& c) {
  GltfOutput s(c);
  s.doc = Json::parse(c.document.json, nullptr, false);
  if (s.doc.is_discarded() || !s.doc.is_object())
    return fail(ErrorKind::kInvalidInput, text("{}: its JSON does not parse", c.document.path.string()));
  for (const char* earlier : {kKilnLightmap, "MOZ_lightmap", "EPIC_lightmap_textures", "MX_lightmap"})
    drop_extension(s.doc, earlier);  // from an earlier bake
  s.drop_earlier_probes();
  if (c.atlas.packed) s.free_texcoord_1();
  KILN_TRY(s.buffer, GltfBuffer::merge(s.doc, c.document));
  KILN_TRY_STATUS(s.buffer.embed_images(s.doc, c.document.path.parent_path()));
  s.file_meshes_ = s.doc.value("meshes", Json::array());
  std::set<size_t> baked;
  for (uint32_t i = 0; i < c.scene.instances.size(); ++i)
    if (!c.display || c.display->is_drawn(i)) baked.insert(c.scene.instances[i].node);
  const Json nodes = s.doc.value("nodes", Json::array());
  for (size_t n = 0; n < nodes.size(); ++n)
    if (nodes[n].contains("mesh") && !baked.count(n)) s.in_use_.insert(nodes[n]["mesh"].get<uint32_t>());
  return s;
}

std::map<uint32_t, std::vector<MeshCopy>> GltfOutput::copies_by_node(const OutputContext& c) {
  const Scene& scene = c.scene;
  std::map<uint32_t, std::vector<MeshCopy>> by_node;
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    if (c.display && !c.display->is_drawn(i)) continue;
    std::vector<MeshCopy>& copies = by_node[scene.instances[i].node];
    const auto has = [&](const MeshCopy& copy) {
      for (const uint32_t other : copy)
        if (scene.instances[other].file_primitive == scene.instances[i].file_primitive) return true;
      return false;
    };
    // The importer lists a copy's primitives together: a repeated primitive starts the next copy.
    if (copies.empty() || has(copies.back())) copies.emplace_back();
    copies.back().push_back(i);
  }
  return by_node;
}

Expected<SplitMesh> GltfOutput::split_faces(const Instance& in, const Mesh& mesh, const MeshCharts& charts) {
  SplitMesh s;
  const Json primitive = file_meshes_[in.file_mesh]["primitives"][in.file_primitive];
  KILN_TRY(const std::vector<uint32_t> corners, buffer.triangle_corners(doc, primitive));
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
  KILN_TRY(s.attributes, buffer.gather_attributes(doc, primitive["attributes"], s.source));
  s.index_accessor = buffer.add_indices(doc, s.indices);
  return s;
}

Expected<const SplitMesh*> GltfOutput::split_mesh(uint32_t instance) {
  const Instance& in = c_->scene.instances[instance];
  const uint32_t set = c_->atlas.charts_of_instance[instance];
  if (const auto it = split_.find(set); it != split_.end()) return &it->second;
  KILN_TRY(SplitMesh s, split_faces(in, c_->scene.meshes[in.mesh], c_->atlas.charts[set]));
  return &split_.emplace(set, std::move(s)).first->second;
}

Expected<Json> GltfOutput::split_primitive(uint32_t instance) {
  KILN_TRY(const SplitMesh* s, split_mesh(instance));
  return primitive_with(c_->scene.instances[instance], *s);
}

Json GltfOutput::file_primitive(uint32_t instance) const {
  const Instance& in = c_->scene.instances[instance];
  return file_meshes_[in.file_mesh]["primitives"][in.file_primitive];
}

Json GltfOutput::primitive_with(const Instance& in, const SplitMesh& s) const {
  Json primitive = file_meshes_[in.file_mesh]["primitives"][in.file_primitive];
  primitive["attributes"] = s.attributes;
  primitive["indices"] = s.index_accessor;
  primitive["mode"] = 4;
  // Morph targets index the file's vertices; a bake freezes the base pose.
  primitive.erase("targets");
  return primitive;
}

size_t GltfOutput::add_mesh(const MeshCopy& copy, Json primitives) {
  const uint32_t place = c_->scene.instances[copy.front()].file_mesh;
  Json mesh = file_meshes_[place];
  mesh["primitives"] = std::move(primitives);
  if (in_use_.insert(place).second) {
    doc["meshes"][place] = std::move(mesh);
    return place;
  }
  doc["meshes"].push_back(std::move(mesh));
  return doc["meshes"].size() - 1;
}

bool GltfOutput::is_repeated(uint32_t node) const {
  const Json& n = doc["nodes"][node];
  return n.contains("extensions") && n["extensions"].contains(kInstancing);
}

size_t GltfOutput::add_root_node(const MeshCopy& copy, size_t mesh) {
  const Instance& in = c_->scene.instances[copy.front()];
  Json matrix = Json::array();
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row)
      matrix.push_back(row < 3 ? double{in.to_world[column][row]} : column == 3 ? 1.0 : 0.0);
  const size_t node = doc["nodes"].size();
  doc["nodes"].push_back({{"mesh", mesh}, {"matrix", matrix}, {"name", in.name}});
  doc["scenes"][doc.value("scene", 0)]["nodes"].push_back(node);
  return node;
}

void GltfOutput::empty_node(uint32_t node) {
  Json& n = doc["nodes"][node];
  n.erase("mesh");
  n["extensions"].erase(kInstancing);
  if (n["extensions"].empty()) n.erase("extensions");
}

Json& GltfOutput::note(Json& object) {
  if (object.contains("extras") && !object["extras"].is_object())
    object["extras"] = Json{{"value", object["extras"]}};
  return object["extras"]["kiln"];
}

void GltfOutput::note_lightmap() {
  Json files = Json::array();
  const bool light = c_->settings.quantities.light;
  for (uint32_t page = 0; light && page < c_->atlas.pages; ++page)
    files.push_back(page_name("irradiance", "exr", page, c_->atlas.pages));
  Json& kiln = note(doc);
  kiln = {{"version", 1},
          {"lightmap", files},
          {"texcoord", 1},
          {"width", c_->atlas.width},
          {"height", c_->atlas.height}};
  if (light) kiln["quantity"] = "irradiance; a renderer shows base colour / pi x E";
  doc["asset"]["generator"] = program_name();
}

void GltfOutput::note_no_lightmap() {
  if (doc.contains("extras") && doc["extras"].is_object() && doc["extras"].contains("kiln")) {
    Json& kiln = doc["extras"]["kiln"];
    if (kiln.is_object() && kiln.contains("lightmap")) doc["extras"].erase("kiln");
    if (doc["extras"].empty()) doc.erase("extras");
  }
  doc["asset"]["generator"] = program_name();
}

Expected<Bytes> GltfOutput::finish(const std::string& name) {
  fill_texcoord_gaps();
  bool repeats = false;
  for (const Json& node : doc.value("nodes", Json::array()))
    repeats |= node.contains("extensions") && node["extensions"].contains(kInstancing);
  if (!repeats) drop_extension(doc, kInstancing);
  drop_unused();
  KILN_TRY_STATUS(buffer.state_bounds(doc));
  const Bytes bytes = buffer.take(doc);
  const std::string json = doc.dump();
  if (uint64_t{json.size()} + bytes.size() > (uint64_t{1} << 32) - 64)
    return fail(ErrorKind::kInvalidInput,
                text("{} would have {} MiB, and a GLB ends at 4 GiB: split the scene", name,
                     (json.size() + bytes.size()) >> 20));
  return write_glb(json, bytes);
}

Expected<std::vector<std::string>> publish_glb(const OutputContext& c, const std::string& name,
                                               Expected<Bytes> (*write)(const OutputContext&)) {
  Expected<Bytes> glb = Bytes{};
  try {
    glb = write(c);
  } catch (const nlohmann::json::exception& e) {
    return fail(ErrorKind::kInternal, text("{}: {}", name, e.what()));
  }
  if (!glb) return tl::unexpected<Error>(glb.error());
  KILN_TRY_STATUS(write_file_atomic(c.folder / name, *glb));
  return std::vector<std::string>{name};
}

}  // namespace kiln
