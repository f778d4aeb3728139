// The one binary buffer of the file that is written, and reading and adding accessors in it.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "common/math/vec.h"
#include "coordinator/scene/document/gltf_document.h"

namespace kiln {

// A vertex of the file, or a point between up to three of them: weights beyond the first 0 where it is one.
struct VertexBlend {
  uint32_t vertex[3] = {0, 0, 0};
  float weight[3] = {1, 0, 0};
  auto operator<=>(const VertexBlend&) const = default;
};

class GltfBuffer {
 public:
  // All buffers of the document in one; buffer views are rewritten to it.
  static Expected<GltfBuffer> merge(nlohmann::json& doc, const GltfDocument& document);

  // Reads image files beside the document into buffer views. One that is missing keeps its URI.
  Status embed_images(nlohmann::json& doc, const std::filesystem::path& folder);

  // The file's vertex of each corner of each triangle, in the importer's order (triangles, strips, fans).
  Expected<std::vector<uint32_t>> triangle_corners(const nlohmann::json& doc,
                                                   const nlohmann::json& primitive) const;

  // New accessors with the elements `source` of each attribute but TEXCOORD_1, as {name: accessor}. A blend
  // of unit normals is made a unit vector again; joints and their weights are those of the nearest vertex.
  // Bounds are left out: state_bounds gives those that glTF asks for.
  Expected<nlohmann::json> gather_attributes(nlohmann::json& doc, const nlohmann::json& attributes,
                                             const std::vector<VertexBlend>& source);
  int add_indices(nlohmann::json& doc, const std::vector<uint32_t>& indices);
  int add_texcoords(nlohmann::json& doc, const std::vector<Vec2>& uv);
  int add_scalars(nlohmann::json& doc, const std::vector<float>& values);
  // A texture of an image held in the buffer, without mips and clamped, for lightmap pages; its index.
  size_t add_page_texture(nlohmann::json& doc, std::span<const std::byte> png, const std::string& name);

  // min and max of every accessor that is a POSITION, from its elements (glTF 2.0, 3.7.2.1).
  Status state_bounds(nlohmann::json& doc) const;
  // Leaves out buffer views and bytes that nothing of `used` names; numbers the others anew.
  void keep_views(nlohmann::json& doc, const std::vector<bool>& used);

  // Writes the length into the document and hands over the bytes.
  Bytes take(nlohmann::json& doc);

 private:
  struct Elements {
    std::vector<std::byte> bytes;  // tightly packed
    size_t size = 0, count = 0;
  };
  Expected<Elements> read_accessor(const nlohmann::json& doc, size_t accessor) const;
  size_t add_view(nlohmann::json& doc, std::span<const std::byte> bytes, int target, size_t stride = 0);

  Bytes bytes_;
};

}  // namespace kiln
