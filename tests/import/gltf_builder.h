// Writes small glTF files for the tests of import, right or wrong as asked.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "coordinator/scene/import/import.h"

namespace kiln::test {

using nlohmann::json;

// `root` is the JSON as it will be written, to be changed at will; `buffer` becomes buffer 0.
struct GltfBuilder {
  GltfBuilder();

  template <class T>
  int view(const std::vector<T>& data, size_t stride = 0) {
    return view_of(std::as_bytes(std::span<const T>(data)), stride);
  }
  int view_of(std::span<const std::byte> data, size_t stride = 0);
  int accessor(int view, int component_type, size_t count, const char* type, size_t offset = 0);
  template <class T>
  int accessor_of(const std::vector<T>& data, int component_type, const char* type, size_t components) {
    return accessor(view(data), component_type, data.size() / components, type);
  }
  int vec3(const std::vector<float>& data) { return accessor_of(data, 5126, "VEC3", 3); }
  int vec2(const std::vector<float>& data) { return accessor_of(data, 5126, "VEC2", 2); }

  int mesh(json primitive);  // of one primitive
  int triangle();            // a mesh: (0,0,0), (1,0,0), (0,1,0), without anything else
  int node(json node);       // added to the scene's roots
  int material(json material);
  int image(std::span<const std::byte> file);  // embedded; makes a texture of it too and returns that
  // A triangle with TEXCOORD_0 and this material, standing in the scene.
  void textured_triangle(json material);

  json root;
  Bytes buffer;
};

// One triangle in the scene, and a point light.
GltfBuilder small_scene();
// Everything that import reads, in one small file.
GltfBuilder rich_scene();

std::filesystem::path write_glb_file(const GltfBuilder& builder, const std::filesystem::path& folder,
                                     const std::string& name = "x.glb");
// As .gltf beside x.bin.
std::filesystem::path write_gltf_file(const GltfBuilder& builder, const std::filesystem::path& folder,
                                      const std::string& name = "x.gltf");

Expected<ImportResult> import(const GltfBuilder& builder, const BakeSettings& settings = {});
// Imports and must succeed.
ImportResult imported(const GltfBuilder& builder, const BakeSettings& settings = {});
// Imports and must fail as invalid input; the message.
std::string refused(const GltfBuilder& builder, const BakeSettings& settings = {});

// A note that contains `part`, or an empty one.
std::string note_with(const ImportResult& result, const std::string& part);
std::string all_notes(const ImportResult& result);

// An 8-bit PNG of one colour. Channels: 3.
Bytes small_png(uint8_t r, uint8_t g, uint8_t b, uint32_t side = 2);

// The message of a failure; empty, and a test failure, when there was none.
template <class T>
std::string message_of(const Expected<T>& result) {
  EXPECT_FALSE(result);
  return result ? std::string() : result.error().message;
}

inline bool says(const std::string& message, const std::string& part) {
  return message.find(part) != std::string::npos;
}

}  // namespace kiln::test

// The message contains this.
#define EXPECT_SAYS(message, part) EXPECT_PRED2(::kiln::test::says, std::string(message), std::string(part))
