// The container: GLB chunks, buffers, URIs.
#include "common/base/files.h"
#include "coordinator/scene/document/glb.h"
#include "coordinator/scene/document/uri.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::json;

std::string message_of(const std::filesystem::path& path) {
  const auto document = read_gltf_document(path);
  EXPECT_FALSE(document);
  return document ? "" : document.error().message;
}

// A .gltf of this text, read.
std::string message_of_text(const std::string& json_text) {
  test::TempDir dir;
  EXPECT_TRUE(write_file_atomic(dir.path() / "x.gltf", json_text));
  return message_of(dir.path() / "x.gltf");
}

TEST(Document, GlbRoundTrip) {
  const std::string json_text = R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":5}]})";
  const Bytes buffer{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}, std::byte{5}};
  const Bytes glb = write_glb(json_text, buffer);
  EXPECT_EQ(glb.size() % 4, 0u);
  const auto parts = read_glb(glb, "x.glb");
  ASSERT_TRUE(parts);
  EXPECT_EQ(json::parse(parts->json), json::parse(json_text));
  ASSERT_TRUE(parts->binary);
  EXPECT_EQ(parts->binary->size(), 8u);
  EXPECT_TRUE(std::equal(buffer.begin(), buffer.end(), parts->binary->begin()));
}

TEST(Document, EveryTruncationOfAGlbIsAnError) {
  test::TempDir dir;
  const auto path = test::write_glb_file(test::small_scene(), dir.path());
  const Bytes whole = read_file(path).value();
  for (size_t size = 0; size < whole.size(); ++size) {
    ASSERT_TRUE(write_file_atomic(path, std::span(whole).first(size)));
    EXPECT_SAYS(message_of(path), "x.glb") << size;
  }
  ASSERT_TRUE(write_file_atomic(path, std::span(whole).first(512)));
  EXPECT_SAYS(message_of(path),
              "truncated: header says " + std::to_string(whole.size()) + " bytes, the file has 512");
}

TEST(Document, CorruptGlbs) {
  test::TempDir dir;
  const auto path = test::write_glb_file(test::small_scene(), dir.path());
  const Bytes whole = read_file(path).value();
  const auto with_word = [&](size_t offset, uint32_t word) {
    Bytes changed = whole;
    std::memcpy(changed.data() + offset, &word, 4);
    EXPECT_TRUE(write_file_atomic(path, changed));
    return message_of(path);
  };
  EXPECT_SAYS(with_word(0, 1), "corrupt: it does not start with \"glTF\"");
  EXPECT_SAYS(with_word(4, 1), "version 1 is not supported");
  EXPECT_SAYS(with_word(8, 5), "corrupt: header says the file has 5 bytes");
  EXPECT_SAYS(with_word(12, 0xfffffff0u), "corrupt: chunk 0 says 4294967280 bytes");
  EXPECT_SAYS(with_word(16, 0x004e4942), "corrupt: the first chunk is not JSON");
}

TEST(Document, JsonThatIsNone) {
  EXPECT_SAYS(message_of_text("{\"asset\": "), "x.gltf: its JSON does not parse at byte");
  EXPECT_SAYS(message_of_text("[]"), "its JSON is not an object");
  EXPECT_SAYS(message_of_text("{\"buffers\": 3}"), "\"buffers\" is not an array");
  EXPECT_SAYS(message_of_text("{\"images\": [7]}"), "\"images\": element 0 is not an object");
  EXPECT_SAYS(message_of_text("{\"extras\": " + std::string(100000, '[') + std::string(100000, ']') + "}"),
              "nested more than 128 levels deep");
  EXPECT_SAYS(message_of_text("{\"a\": 1e999}"), "its JSON does not parse");
}

TEST(Document, BuffersBesideTheFile) {
  test::TempDir dir;
  const auto path = test::write_gltf_file(test::small_scene(), dir.path());
  ASSERT_TRUE(read_gltf_document(path));
  EXPECT_TRUE(import_scene(path, {}));
  std::filesystem::resize_file(dir.path() / "x.bin", 7);
  EXPECT_SAYS(message_of(path), "x.gltf: buffer 0: byteLength says 36 bytes, its data has 7");
  std::filesystem::remove(dir.path() / "x.bin");
  EXPECT_SAYS(message_of(path), "x.gltf: buffer 0: missing file x.bin");
}

TEST(Document, DataUris) {
  const auto buffer = [](const std::string& uri, int length) {
    return R"({"buffers": [{"byteLength": )" + std::to_string(length) + R"(, "uri": ")" + uri + "\"}]}";
  };
  test::TempDir dir;
  const auto path = dir.path() / "x.gltf";
  ASSERT_TRUE(write_file_atomic(path, buffer("data:application/octet-stream;base64,AQID/w==", 4)));
  const auto document = read_gltf_document(path);
  ASSERT_TRUE(document) << document.error().message;
  EXPECT_EQ(*document->buffers[0], (Bytes{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{255}}));
  EXPECT_SAYS(message_of_text(buffer("data:;base64,AQID", 4)), "byteLength says 4 bytes, its data has 3");
  EXPECT_SAYS(message_of_text(buffer("data:;base64,A*ID", 3)), "character 1 of its base64 text");
  EXPECT_SAYS(message_of_text(buffer("data:text,abc", 3)), "is not base64");
  EXPECT_SAYS(message_of_text(buffer("data:", 3)), "no comma");
  EXPECT_SAYS(message_of_text(R"({"buffers": [{"byteLength": 4}]})"), "neither a URI nor a binary chunk");
  EXPECT_SAYS(message_of_text(R"({"buffers": [{"byteLength": -4, "uri": "x"}]})"),
              "byteLength is not a length");
}

// A scene that is sent to a farm must not read the farm's files.
TEST(Document, UrisStayInTheFolder) {
  const std::filesystem::path folder = "/scenes/a";
  EXPECT_EQ(resolve_uri(folder, "b.bin").value(), "/scenes/a/b.bin");
  EXPECT_EQ(resolve_uri(folder, "sub/my%20file.bin").value(), "/scenes/a/sub/my file.bin");
  EXPECT_EQ(resolve_uri(folder, "sub/../b.bin").value(), "/scenes/a/b.bin");
  EXPECT_EQ(resolve_uri(folder, "100%.bin").value(), "/scenes/a/100%.bin");
  for (const char* bad : {"/etc/passwd", "../b.bin", "sub/../../b.bin", "%2e%2e/b.bin", "%2Fetc/passwd",
                          "file:///etc/passwd", "http://example.com/a", "C:\\a", "", "a%00b"})
    EXPECT_FALSE(resolve_uri(folder, bad)) << bad;
}

TEST(Document, FallbackBuffersMayBeEmpty) {
  test::TempDir dir;
  const auto path = dir.path() / "x.gltf";
  ASSERT_TRUE(write_file_atomic(path, R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 1000000000,
    "extensions": {"EXT_meshopt_compression": {"fallback": true}}}],
    "extensionsRequired": ["EXT_meshopt_compression"]})"));
  ASSERT_TRUE(read_gltf_document(path));
  EXPECT_SAYS(test::message_of(import_scene(path, {})), "the scene has no triangles to bake");
}

TEST(Document, StructureHasNeitherBuffersNorImages) {
  test::GltfBuilder b = test::small_scene();
  b.image(test::small_png(1, 2, 3));
  test::TempDir dir;
  const auto document = read_gltf_document(test::write_glb_file(b, dir.path()));
  ASSERT_TRUE(document);
  const json structure = json::parse(document->structure), whole = json::parse(document->json);
  EXPECT_FALSE(structure.contains("buffers") || structure.contains("images"));
  EXPECT_TRUE(whole.contains("buffers") && whole.contains("images"));
  ASSERT_EQ(document->images.size(), 1u);
  EXPECT_EQ(document->images[0].buffer_view, b.root["images"][0]["bufferView"]);
}

TEST(Document, MissingFileIsNamed) {
  EXPECT_SAYS(message_of("/nowhere/x.glb"), "/nowhere/x.glb: no such file");
}

}  // namespace
}  // namespace kiln
