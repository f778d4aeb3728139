// Splits a primitive whose charts are on several pages, one primitive per page. They share vertices: a vertex
// belongs to one chart, so only the indices differ.
#include "coordinator/output/gltf/output_file.h"

namespace kiln {

using Json = nlohmann::json;

void mark_page(Json& primitive, uint32_t page) {
  primitive["extensions"][kKilnLightmap] = {{"page", page}};
}

Json GltfOutput::by_page(const Json& primitive, const SplitMesh& split,
                         const std::vector<uint32_t>& placement) {
  const auto page_of = [&](uint32_t vertex) { return c_->atlas.placements[placement[vertex]].page; };
  std::map<uint32_t, std::vector<uint32_t>> faces;  // indices by page
  for (size_t i = 0; i + 2 < split.indices.size(); i += 3) {
    std::vector<uint32_t>& list = faces[page_of(split.indices[i])];
    list.insert(list.end(), split.indices.begin() + static_cast<ptrdiff_t>(i),
                split.indices.begin() + static_cast<ptrdiff_t>(i + 3));
  }
  Json out = Json::array();
  for (const auto& [page, indices] : faces) {
    Json part = primitive;
    if (faces.size() > 1) part["indices"] = buffer.add_indices(doc, indices);
    mark_page(part, page);
    out.push_back(std::move(part));
  }
  if (out.empty()) {  // a mesh without faces
    out.push_back(primitive);
    mark_page(out.back(), 0);
  }
  return out;
}

}  // namespace kiln
