#include <algorithm>

#include "coordinator/encode/gltf_output.h"

namespace kiln {

using Json = nlohmann::json;

void GltfOutput::note_pages(Json& primitive, const std::vector<uint32_t>& placements) const {
  if (c_->atlas.pages < 2 || placements.empty()) return;
  Json pages = Json::array();
  for (const uint32_t placement : placements) {
    const uint32_t page = c_->atlas.placements[placement].page;
    if (std::find(pages.begin(), pages.end(), Json(page)) == pages.end()) pages.push_back(page);
  }
  note(primitive)["pages"] = pages;
}

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
      note_pages(primitive, placements);
      primitives.push_back(std::move(primitive));
    }
    mesh["primitives"] = std::move(primitives);
    note(mesh)["texcoord_space"] = "lightmap";  // in scene_instanced.glb that of other meshes is the chart
    doc["nodes"][node]["mesh"] = doc["meshes"].size();
    doc["meshes"].push_back(std::move(mesh));
  }
  return {};
}

}  // namespace kiln
