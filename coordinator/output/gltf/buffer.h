// The single binary buffer of the file being written; reads and adds accessors.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "common/math/vec.h"
#include "coordinator/scene/document/gltf_document.h"

namespace kiln {

// A vertex of the file, or a blend of up to three; for a single vertex all weights but the first are 0.
struct VertexBlend {
  uint32_t vertex[3] = {0, 0, 0};
  float weight[3] = {1, 0, 0};
  auto operator<=>(const VertexBlend&) const = default;
};

class GltfBuffer {
 public:
  // Merges all buffers of the document and rewrites buffer views.
  static Expected<GltfBuffer> merge(nlohmann::json& doc, const GltfDocument& document);

  // Reads image files beside the document into buffer views. Missing files keep their URI.
  Status embed_images(nlohmann::json& doc, const std::filesystem::path& folder);

  // The file's vertex of each corner of each triangle, in the importer's order (triangles, strips, fans).
  Expected<std::vector<uint32_t>> triangle_corners(const nlohmann::json& doc,
                                                   const nlohmann::json& primitive) const;

  // Adds an accessor for each attribute except TEXCOORD_1, with an element for each entry of `source`, and
  // returns {name: accessor}.
  // Blended normals are normalised; joints and their weights are those of the nearest vertex. Writes no
  // bounds: state_bounds adds those that glTF requires.
  Expected<nlohmann::json> gather_attributes(nlohmann::json& doc, const nlohmann::json& attributes,
                                             const std::vector<VertexBlend>& source);
  int add_indices(nlohmann::json& doc, const std::vector<uint32_t>& indices);
  int add_texcoords(nlohmann::json& doc, const std::vector<Vec2>& uv);
  int add_scalars(nlohmann::json& doc, const std::vector<float>& values);
  // Adds a texture for an image in the buffer, without mips and clamped, for lightmap pages; returns its
  // index.
  size_t add_page_texture(nlohmann::json& doc, std::span<const std::byte> png, const std::string& name);

  // Sets min and max of every accessor used as a POSITION from its elements (glTF 2.0, 3.7.2.1).
  Status state_bounds(nlohmann::json& doc) const;
  // Removes the buffer views that `used` does not mark, and their bytes, and renumbers the others.
  void keep_views(nlohmann::json& doc, const std::vector<bool>& used);

  // Writes the length into the document and returns the bytes.
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
