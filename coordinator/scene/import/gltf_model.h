// The structure of a glTF file in our own types, as written: indices are unchecked and nothing is loaded.
// Indices are -1 where the file has none.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "coordinator/scene/document/gltf_document.h"
#include "coordinator/scene/import/gltf_value.h"

namespace kiln {

struct GltfBufferView {
  int buffer = -1;
  size_t offset = 0, length = 0;
  size_t stride = 0;  // 0: tightly packed
};

struct GltfAccessor {
  int buffer_view = -1;
  size_t offset = 0, count = 0;
  int component_type = 0;   // 5120 to 5126, as in the file
  uint32_t components = 0;  // 1 to 4, or 4, 9, 16 of a matrix
  bool normalized = false;
  struct Sparse {
    int64_t count = 0;
    int index_view = -1, value_view = -1;
    int64_t index_offset = 0, value_offset = 0;
    int index_type = 0;
  };
  std::optional<Sparse> sparse;
};

struct GltfPrimitive {
  std::map<std::string, int> attributes;
  int indices = -1, material = -1;
  int mode = 4;  // triangles
  bool morphed = false;
  GltfExtensions extensions;
};

struct GltfMesh {
  std::string name;
  std::vector<GltfPrimitive> primitives;
  GltfValue extras;
};

struct GltfNode {
  std::string name;
  int mesh = -1, camera = -1, skin = -1;
  std::vector<int> children;
  std::vector<double> matrix, translation, rotation, scale;  // empty where absent
  GltfExtensions extensions;
  GltfValue extras;
};

struct GltfTextureInfo {
  int texture = -1, uv_set = 0;
  GltfExtensions extensions;
};

struct GltfMaterial {
  std::string name;
  std::array<double, 4> base_color;
  std::array<double, 3> emissive;
  double metallic = 1, roughness = 1, alpha_cutoff = 0.5, normal_scale = 1;
  std::string alpha_mode;
  bool double_sided = false;
  GltfTextureInfo base_color_texture, metallic_roughness_texture, emissive_texture, normal_texture;
  GltfExtensions extensions;
  GltfValue extras;
};

struct GltfSampler {
  int mag_filter = -1, wrap_s = 10497, wrap_t = 10497;
};

struct GltfTexture {
  std::string name;
  int source = -1, sampler = -1;
  GltfExtensions extensions;
};

struct GltfCamera {
  std::string name;
  bool perspective = false;
  double vertical_fov = 0;
  double aspect = 0;  // 0: not given
};

struct GltfLight {
  std::string name, type;
  std::vector<double> color;        // empty: white
  double intensity = 1, range = 0;  // range 0: no limit
  double inner = 0, outer = 0;
  GltfValue extras;
};

struct GltfScene {
  std::string name;
  std::vector<int> nodes;
  GltfExtensions extensions;
  GltfValue extras;
};

struct GltfModel {
  std::vector<GltfBufferView> buffer_views;
  std::vector<GltfAccessor> accessors;
  std::vector<GltfMesh> meshes;
  std::vector<GltfNode> nodes;
  std::vector<GltfMaterial> materials;
  std::vector<GltfSampler> samplers;
  std::vector<GltfTexture> textures;
  std::vector<GltfCamera> cameras;
  std::vector<GltfLight> lights;
  std::vector<GltfScene> scenes;
  int default_scene = -1;
  bool animated = false;
  std::string generator;  // asset.generator
  std::vector<std::string> extensions_used, extensions_required;
  GltfExtensions extensions;
};

// Parses the document's structure.
Expected<GltfModel> parse_gltf_model(const GltfDocument& document);

}  // namespace kiln
