#include "coordinator/output/gltf/output_file.h"

namespace kiln {

using Json = nlohmann::json;

Status GltfOutput::give_levels_their_meshes() {
  if (!c_->display) return {};
  const std::vector<DisplayMesh>& shown = c_->display->shown;
  std::map<uint32_t, std::vector<uint32_t>> by_node;  // display meshes: primitives of the node's mesh
  for (uint32_t i = 0; i < shown.size(); ++i) by_node[shown[i].place.node].push_back(i);
  for (const auto& [node, primitives_of] : by_node) {
    Json mesh = file_meshes_[shown[primitives_of.front()].place.file_mesh];
    Json primitives = Json::array();
    for (const uint32_t i : primitives_of) {
      const Instance& in = shown[i].place;
      const ProjectedCharts& projected = c_->projection->charts[i];
      KILN_TRY(const SplitMesh s, split_faces(in, c_->display->meshes[in.mesh], projected.charts));
      std::vector<Vec2> uv;
      std::vector<uint32_t> placements;
      for (size_t v = 0; v < s.source.size(); ++v) {
        uv.push_back(s.chart_uv[v] / Vec2(c_->atlas.width, c_->atlas.height));
        placements.push_back(projected.placement[s.chart[v]]);
      }
      Json primitive = primitive_with(in, s);
      primitive["attributes"]["TEXCOORD_1"] = buffer.add_texcoords(doc, uv);
      for (Json& part : by_page(primitive, s, placements)) primitives.push_back(std::move(part));
    }
    mesh["primitives"] = std::move(primitives);
    note(mesh)["texcoord_space"] =
        "lightmap";  // in scene_instanced.glb other meshes are relative to the chart
    doc["nodes"][node]["mesh"] = doc["meshes"].size();
    doc["meshes"].push_back(std::move(mesh));
  }
  return {};
}

}  // namespace kiln
