#include "tests/import/gltf_builder.h"

#include "common/base/files.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln::test {
namespace fs = std::filesystem;

GltfBuilder::GltfBuilder() {
  root = json::parse(R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]})");
}

int GltfBuilder::view_of(std::span<const std::byte> data, size_t stride) {
  buffer.resize((buffer.size() + 3) & ~size_t{3});
  json v = {{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", data.size()}};
  if (stride) v["byteStride"] = stride;
  buffer.insert(buffer.end(), data.begin(), data.end());
  root["bufferViews"].push_back(v);
  return static_cast<int>(root["bufferViews"].size()) - 1;
}

int GltfBuilder::accessor(int view, int component_type, size_t count, const char* type, size_t offset) {
  root["accessors"].push_back({{"bufferView", view},
                               {"componentType", component_type},
                               {"count", count},
                               {"type", type},
                               {"byteOffset", offset}});
  return static_cast<int>(root["accessors"].size()) - 1;
}

int GltfBuilder::mesh(json primitive) {
  json mesh;
  mesh["primitives"].push_back(std::move(primitive));
  root["meshes"].push_back(std::move(mesh));
  return static_cast<int>(root["meshes"].size()) - 1;
}

int GltfBuilder::triangle() {
  return mesh({{"attributes", {{"POSITION", vec3({0, 0, 0, 1, 0, 0, 0, 1, 0})}}}});
}

int GltfBuilder::node(json node) {
  root["nodes"].push_back(std::move(node));
  const int index = static_cast<int>(root["nodes"].size()) - 1;
  root["scenes"][0]["nodes"].push_back(index);
  return index;
}

int GltfBuilder::material(json material) {
  root["materials"].push_back(std::move(material));
  return static_cast<int>(root["materials"].size()) - 1;
}

int GltfBuilder::image(std::span<const std::byte> file) {
  root["images"].push_back({{"bufferView", view_of(file)}, {"mimeType", "image/png"}});
  root["textures"].push_back({{"source", root["images"].size() - 1}});
  return static_cast<int>(root["textures"].size()) - 1;
}

void GltfBuilder::textured_triangle(json m) {
  const int index =
      mesh({{"attributes",
             {{"POSITION", vec3({0, 0, 0, 1, 0, 0, 0, 1, 0})}, {"TEXCOORD_0", vec2({0, 0, 1, 0, 0, 1})}}},
            {"material", material(std::move(m))}});
  node({{"mesh", index}});
}

GltfBuilder small_scene() {
  GltfBuilder b;
  b.node({{"mesh", b.triangle()}});
  b.root["extensionsUsed"] = {"KHR_lights_punctual"};
  b.root["extensions"]["KHR_lights_punctual"]["lights"].push_back({{"type", "point"}, {"intensity", 10}});
  b.node(json::parse(R"({"translation": [0, 0, 2], "extensions": {"KHR_lights_punctual": {"light": 0}}})"));
  return b;
}

GltfBuilder rich_scene() {
  GltfBuilder b = small_scene();
  const int t = b.image(small_png(9, 99, 199, 4));
  b.root["samplers"] = {{{"wrapS", 33071}}};
  b.root["textures"][t]["sampler"] = 0;
  json m = json::parse(
      R"({"alphaMode": "MASK", "emissiveFactor": [1, 1, 1], "pbrMetallicRoughness": {"baseColorTexture":
    {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.5], "rotation": 1}}}},
    "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}, "KHR_materials_ior": {"ior": 1.5}}})");
  b.textured_triangle(m);
  json indexed = {{"attributes",
                   {{"POSITION", b.vec3({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0})},
                    {"NORMAL", b.vec3(std::vector<float>(12, 1.0f))}}},
                  {"indices", b.accessor_of(std::vector<uint16_t>{0, 1, 2, 0, 2, 3}, 5123, "SCALAR", 1)}};
  b.root["accessors"][0]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", b.view(std::vector<uint8_t>{1})}, {"componentType", 5121}}},
      {"values", {{"bufferView", b.view(std::vector<float>{2, 0, 0})}}}};
  json node = {{"mesh", b.mesh(indexed)}};
  node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = b.vec3({1, 1, 1, 2, 2, 2});
  b.node(node);
  b.root["nodes"][0]["children"] = {static_cast<int>(b.root["nodes"].size())};
  b.root["nodes"].push_back({{"camera", 0}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1}}});
  b.root["cameras"] = json::parse(R"([{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}])");
  b.root["extensions"]["EXT_lights_image_based"]["lights"] =
      json::parse(R"([{"specularImages": [[0, 0, 0, 0, 0, 0]]}])");
  b.root["scenes"][0]["extensions"]["EXT_lights_image_based"]["light"] = 0;
  return b;
}

fs::path write_glb_file(const GltfBuilder& builder, const fs::path& folder, const std::string& name) {
  json root = builder.root;
  if (!builder.buffer.empty()) root["buffers"] = {{{"byteLength", builder.buffer.size()}}};
  EXPECT_TRUE(write_file_atomic(folder / name, write_glb(root.dump(), builder.buffer)));
  return folder / name;
}

fs::path write_gltf_file(const GltfBuilder& builder, const fs::path& folder, const std::string& name) {
  json root = builder.root;
  root["buffers"] = {{{"byteLength", builder.buffer.size()}, {"uri", "x.bin"}}};
  EXPECT_TRUE(write_file_atomic(folder / "x.bin", builder.buffer));
  EXPECT_TRUE(write_file_atomic(folder / name, root.dump()));
  return folder / name;
}

Expected<ImportResult> import(const GltfBuilder& builder, const BakeSettings& settings) {
  TempDir dir;
  return import_scene(write_glb_file(builder, dir.path()), settings);
}

ImportResult imported(const GltfBuilder& builder, const BakeSettings& settings) {
  auto result = import(builder, settings);
  EXPECT_TRUE(result) << (result ? "" : result.error().message);
  return result ? std::move(*result) : ImportResult{};
}

std::string refused(const GltfBuilder& builder, const BakeSettings& settings) {
  auto result = import(builder, settings);
  EXPECT_FALSE(result);
  if (result) return {};
  EXPECT_EQ(result.error().kind, ErrorKind::kInvalidInput) << result.error().message;
  return result.error().message;
}

std::string note_with(const ImportResult& result, const std::string& part) {
  for (const ImportNote& note : result.notes)
    if (note.what.find(part) != std::string::npos) return note.what;
  return {};
}

std::string all_notes(const ImportResult& result) {
  std::string out;
  for (const ImportNote& note : result.notes) out += "  " + note.what + "\n";
  return out;
}

Bytes small_png(uint8_t r, uint8_t g, uint8_t b, uint32_t side) {
  std::vector<uint8_t> rgb;
  for (uint32_t i = 0; i < side * side; ++i) rgb.insert(rgb.end(), {r, g, b});
  return encode_png(side, side, rgb).value();
}

}  // namespace kiln::test
