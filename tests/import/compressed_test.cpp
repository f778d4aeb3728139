// Compressed scenes as other programs write them, against what those programs' decoders make of them
// (tests/node/compress/goldens.mjs wrote both), and damaged ones.
#include <random>

#include "common/base/files.h"
#include "common/scene/prepared.h"
#include "coordinator/scene/document/draco.h"
#include "coordinator/scene/document/expand.h"
#include "coordinator/scene/document/meshopt.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;
using test::json;

fs::path golden(const std::string& name) {
  return test::source_dir() / "tests/import/compressed" / (name + ".glb");
}

ImportResult read(const std::string& name) {
  auto result = import_scene(golden(name), {});
  EXPECT_TRUE(result) << (result ? "" : result.error().message);
  return result ? std::move(*result) : ImportResult{};
}

Digest digest_of(const Scene& scene) {
  ChunkStore store;
  return write_scene(scene, store);
}

TEST(Compressed, DataIsWhatTheEncodersOwnDecodersRead) {
  for (const std::string name : {"filters", "triangles", "quantized", "draco", "sequential"}) {
    SCOPED_TRACE(name);
    const ImportResult ours = read(name), theirs = read(name + ".plain");
    ASSERT_GT(ours.scene.triangle_count(), 500u);
    EXPECT_EQ(digest_of(ours.scene), digest_of(theirs.scene));
  }
}

TEST(Compressed, DataThatNoBitOfChangedBakesAlike) {
  const Digest plain = digest_of(read("scene").scene);
  EXPECT_EQ(digest_of(read("meshopt").scene), plain);
  EXPECT_EQ(digest_of(read("webp").scene), plain) << "lossless";
}

TEST(Compressed, AvifColoursAreNear) {
  const Scene plain = read("scene").scene, avif = read("avif").scene;
  ASSERT_EQ(avif.textures.size(), 1u);
  const Texture &a = plain.textures.at(0), &b = avif.textures.at(0);
  ASSERT_TRUE(a.width == b.width && a.height == b.height && a.channels == b.channels);
  double sum = 0;
  for (size_t i = 0; i < a.texels.size(); ++i)
    sum += std::abs(static_cast<int>(a.texels[i]) - static_cast<int>(b.texels[i]));
  EXPECT_LT(sum / static_cast<double>(a.texels.size()), 3) << "of 255";
  EXPECT_GT(sum, 0);
}

TEST(Compressed, TheDocumentIsPlainAndSaysWhatWasRead) {
  const ImportResult r = read("meshopt");
  EXPECT_SAYS(test::note_with(r, "EXT_meshopt_compression"), "read; scene.glb has the same data without it");
  EXPECT_EQ(r.document.json.find("meshopt"), std::string::npos);
  const json root = json::parse(r.document.json);
  EXPECT_EQ(root["buffers"].size(), r.document.buffers.size());
  const ImportResult draco = read("draco");
  EXPECT_EQ(draco.document.json.find("draco"), std::string::npos);
  EXPECT_EQ(draco.document.expanded, std::vector<std::string>{"KHR_draco_mesh_compression"});
}

// The golden file `name` with its JSON changed.
std::string message(const std::string& name, const std::function<void(json&)>& change) {
  const auto document = [&] {
    const Bytes file = read_file(golden(name)).value();
    uint32_t length;
    std::memcpy(&length, &file[12], 4);
    json root = json::parse(std::string(reinterpret_cast<const char*>(&file[20]), length));
    return std::pair(root, Bytes(file.begin() + 28 + length, file.end()));
  }();
  json root = document.first;
  change(root);
  test::TempDir dir;
  EXPECT_TRUE(write_file_atomic(dir.path() / "x.glb", write_glb(root.dump(), document.second)));
  return test::message_of(import_scene(dir.path() / "x.glb", {}));
}

json& packed_view(json& root, const char* mode) {
  for (json& view : root["bufferViews"])
    if (view.contains("extensions") && view["extensions"]["EXT_meshopt_compression"]["mode"] == mode)
      return view["extensions"]["EXT_meshopt_compression"];
  return root;
}

TEST(Compressed, WrongMeshoptIsNamedWithItsPlace) {
  const auto changed = [](const char* mode, const char* key, const json& value) {
    return message("meshopt", [&](json& root) { packed_view(root, mode)[key] = value; });
  };
  EXPECT_SAYS(changed("ATTRIBUTES", "buffer", 7), "x.glb: buffer view 0: EXT_meshopt_compression: buffer 7");
  EXPECT_SAYS(changed("ATTRIBUTES", "byteLength", 1u << 30), "do not fit in buffer 0");
  EXPECT_SAYS(changed("ATTRIBUTES", "byteLength", 20),
              "20 packed bytes cannot hold 294 elements of 12 bytes");
  EXPECT_SAYS(changed("ATTRIBUTES", "byteLength", 700), "end before element");
  EXPECT_SAYS(changed("ATTRIBUTES", "byteOffset", 4), "begin with");
  EXPECT_SAYS(changed("ATTRIBUTES", "byteStride", 3), "its stride is 3");
  EXPECT_SAYS(changed("ATTRIBUTES", "byteStride", 512), "its stride is 512");
  EXPECT_SAYS(changed("ATTRIBUTES", "count", -1), "its count or byteStride is no whole number");
  EXPECT_SAYS(changed("ATTRIBUTES", "count", 293), "are not the view's byteLength");
  EXPECT_SAYS(changed("ATTRIBUTES", "count", uint64_t{1} << 62), "cannot hold");
  EXPECT_SAYS(changed("ATTRIBUTES", "mode", "POINTS"), "its mode is none of");
  EXPECT_SAYS(changed("ATTRIBUTES", "filter", "COLOR"), "its filter is none of");
  EXPECT_SAYS(changed("ATTRIBUTES", "filter", "QUATERNION"), "the quaternion filter takes 8 bytes");
  EXPECT_SAYS(changed("ATTRIBUTES", "filter", "OCTAHEDRAL"), "the octahedral filter takes 4 or 8 bytes");
  EXPECT_SAYS(changed("INDICES", "filter", "OCTAHEDRAL"), "which indices have not");
  EXPECT_SAYS(changed("INDICES", "mode", "TRIANGLES"), "begin with 0xd1 where version 1 begins with 0xe1");
  EXPECT_SAYS(changed("INDICES", "byteStride", 8), "indices have 2 or 4 bytes");
}

TEST(Compressed, WrongDracoIsNamedWithItsPlace) {
  const auto changed = [](const std::function<void(json & primitive, json & root)>& change) {
    return message("draco", [&](json& root) { change(root["meshes"][0]["primitives"][0], root); });
  };
  const auto extension = [](json& p) -> json& { return p["extensions"]["KHR_draco_mesh_compression"]; };
  EXPECT_SAYS(changed([&](json& p, json&) { extension(p)["bufferView"] = 99; }),
              "x.glb: mesh 0 primitive 0: KHR_draco_mesh_compression: the buffer view of its Draco data");
  EXPECT_SAYS(changed([&](json& p, json&) { extension(p)["attributes"]["POSITION"] = 77; }),
              "its Draco data has no attribute 77");
  EXPECT_SAYS(changed([&](json& p, json&) { extension(p)["attributes"]["TANGENT"] = 0; }),
              "its Draco data has TANGENT, the primitive has not");
  EXPECT_SAYS(changed([&](json& p, json&) { extension(p).erase("attributes"); }), "are missing");
  EXPECT_SAYS(changed([&](json& p, json& root) {
                root["accessors"][p["attributes"]["NORMAL"].get<size_t>()]["type"] = "VEC2";
              }),
              "has 3 components, its accessor 2");
  EXPECT_SAYS(changed([&](json& p, json&) { p["attributes"]["NORMAL"] = 999; }),
              "accessor 999 does not exist");
  EXPECT_SAYS(changed([&](json& p, json&) { p["mode"] = 1; }), "its mode is neither");
  EXPECT_SAYS(changed([&](json& p, json& root) {
                root["bufferViews"][extension(p)["bufferView"].get<size_t>()]["byteLength"] = 60;
              }),
              "its Draco data does not decode");
  EXPECT_SAYS(changed([&](json& p, json& root) {
                root["bufferViews"][extension(p)["bufferView"].get<size_t>()]["byteLength"] = 4;
              }),
              "its data is not Draco's");
}

// The originals beside the compressed data are what is baked: Draco's positions are rounded.
TEST(Compressed, OriginalsComeBeforeDraco) {
  test::GltfBuilder b = test::small_scene();
  b.root["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 0}};
  EXPECT_EQ(test::imported(b).scene.triangle_count(), 1u);
  b.root["accessors"][0].erase("bufferView");
  EXPECT_SAYS(test::refused(b), "mesh 0 primitive 0: KHR_draco_mesh_compression: its attributes");
}

Bytes draco_of(const std::string& name) {
  const auto document = read_file(golden(name)).value();
  const std::string_view file(reinterpret_cast<const char*>(document.data()), document.size());
  const size_t at = file.find("DRACO");
  return Bytes(document.begin() + static_cast<ptrdiff_t>(at), document.end());
}

// A hundred bytes that say they are a thousand million triangles cost nothing.
TEST(Compressed, DracoAsksBeforeItTakes) {
  for (const std::string name : {"draco", "sequential"}) {
    Bytes data = draco_of(name);
    uint64_t asked = 0;
    const auto little = [&](uint64_t bytes) -> Status {
      asked += bytes;
      if (asked < 1000) return {};
      return fail(ErrorKind::kInvalidInput, "too much");
    };
    EXPECT_EQ(test::message_of(unpack_draco(data, {}, little)), "too much") << name;
    EXPECT_GT(asked, 1000u);
    // Edgebreaker: method of traversal, vertices, triangles; the other: triangles, vertices.
    const size_t first = name == "draco" ? 12 : 11;
    for (size_t i = 0; i < 4; ++i) data[first + i] = std::byte{0xff};
    data[first + 4] = std::byte{0x07};
    asked = 0;
    EXPECT_EQ(test::message_of(unpack_draco(data, {}, little)), "too much") << name;
    EXPECT_GT(asked, uint64_t{1} << 36) << name;
  }
}

TEST(Compressed, DamageIsRefusedOrRead) {
  for (const std::string name : {"meshopt", "triangles", "filters", "draco", "sequential", "webp", "avif"}) {
    const Bytes whole = read_file(golden(name)).value();
    uint32_t length;
    std::memcpy(&length, &whole[12], 4);
    test::TempDir dir;
    const fs::path path = dir.path() / "x.glb";
    size_t refused = 0;
    for (uint32_t seed = 0; seed < 150; ++seed) {
      std::mt19937 random(seed);
      Bytes file = whole;
      for (uint32_t e = 0; e < 1 + seed % 4; ++e)  // of the data, not of the JSON
        file[28 + length + random() % (file.size() - 28 - length)] = static_cast<std::byte>(random());
      ASSERT_TRUE(write_file_atomic(path, file));
      SCOPED_TRACE(name + " " + std::to_string(seed));
      const auto result = import_scene(path, {});
      if (result) continue;
      ++refused;
      EXPECT_EQ(result.error().kind, ErrorKind::kInvalidInput);
      EXPECT_SAYS(result.error().message, "x.glb");
    }
    if (name != "webp" && name != "avif" && name != "filters") EXPECT_GT(refused, 0u) << name;
  }
}

TEST(OtherFormats, AreNamedWithTheWayToGltf) {
  test::TempDir dir;
  const auto said = [&](const std::string& name, std::string_view content) {
    EXPECT_TRUE(write_file_atomic(dir.path() / name, bytes_of(content)));
    return test::message_of(import_scene(dir.path() / name, {}));
  };
  EXPECT_SAYS(said("a.obj", "# Blender\nv 1 2 3\n"), "a.obj: it is Wavefront OBJ, and Kiln reads glTF 2.0");
  EXPECT_SAYS(said("a.OBJ", "v 1 2 3\n"), "File > Import > Wavefront, then File > Export > glTF 2.0");
  EXPECT_SAYS(said("a.usdc", "PXR-USDC\x01"), "File > Import > Universal Scene Description");
  EXPECT_SAYS(said("a.usdz", "PK\x03\x04"), "OpenUSD");
  EXPECT_SAYS(said("scene", "BLENDER-v304"), "it is a Blender file");
  EXPECT_SAYS(said("a.fbx", "; FBX 7.4.0"), "FBX");
  EXPECT_SAYS(said("README.md", "# Kiln"), "it is neither a GLB, which begins with \"glTF\", nor the JSON");
  EXPECT_SAYS(said("empty.gltf", ""), "neither a GLB");
  EXPECT_SAYS(test::message_of(import_scene(dir.path(), {})),
              "it is a folder: name the .gltf or .glb file in it");
}

TEST(Visibility, HiddenNodesAreLeftOutWithTheirChildren) {
  test::GltfBuilder b = test::small_scene();
  const int child = static_cast<int>(b.root["nodes"].size());
  b.root["nodes"].push_back({{"mesh", 0}, {"name", "inside"}});
  b.node({{"name", "closed"}, {"children", {child}}});
  EXPECT_EQ(test::imported(b).scene.instances.size(), 2u);
  json& closed = b.root["nodes"].back();
  closed["extensions"]["KHR_node_visibility"]["visible"] = true;
  EXPECT_EQ(test::imported(b).scene.instances.size(), 2u);
  closed["extensions"]["KHR_node_visibility"]["visible"] = false;
  const ImportResult r = test::imported(b);
  EXPECT_EQ(r.scene.instances.size(), 1u);
  EXPECT_SAYS(test::note_with(r, "KHR_node_visibility leaves out"),
              "1 node that is not visible: node 3 'closed'");
  // Its lamp shines no more either.
  b.root["nodes"][1]["extensions"]["KHR_node_visibility"]["visible"] = false;
  EXPECT_TRUE(test::imported(b).scene.lights.empty());
}

}  // namespace
}  // namespace kiln
