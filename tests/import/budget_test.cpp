// A few bytes of a file that ask for gigabytes are refused with a sentence, before the memory is taken.
#include "coordinator/scene/document/budget.h"

#include <sys/resource.h>

#include <atomic>
#include <cstdlib>
#include <thread>

#include "common/base/files.h"
#include "coordinator/scene/document/json_weight.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;
using test::GltfBuilder;
using test::imported;
using test::json;
using test::message_of;
using test::note_with;
using test::refused;

// A triangle placed `count` times by arrays of zeros, which take no byte of the file.
GltfBuilder instanced(uint64_t count) {
  GltfBuilder b;
  b.root["accessors"].push_back({{"componentType", 5126}, {"count", count}, {"type", "VEC3"}});
  b.node({{"mesh", b.triangle()},
          {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", 0}}}}}}}});
  b.root["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  return b;
}

uint64_t peak_bytes() {
  rusage use{};
  ::getrusage(RUSAGE_SELF, &use);
  return static_cast<uint64_t>(use.ru_maxrss) << 10;
}

constexpr uint64_t kMiB = uint64_t{1} << 20;

TEST(ImportBudget, TheSumDecides) {
  ImportBudget budget("x.glb", 0);
  EXPECT_TRUE(budget.take(ImportBudget::kAnyFile, "its meshes"));
  EXPECT_FALSE(budget.is_spent());
  const Status refused = budget.take(1, "its lights");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kInvalidInput);
  EXPECT_SAYS(refused.error().message, "x.glb: its lights would take more memory than the 1024 MiB");
  EXPECT_SAYS(refused.error().message, "KILN_IMPORT_MIB");
  EXPECT_FALSE(budget.take(0, "its lights")) << "it stays spent";
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(budget.take(~uint64_t{0}, "sums")) << "and never wraps around";

  ImportBudget large("x.glb", 100 * kMiB);
  large.add_file(100 * kMiB);
  EXPECT_TRUE(large.take(ImportBudget::kAnyFile + 3200 * kMiB, "its meshes"));
  EXPECT_FALSE(large.take(1, "its meshes"));
}

TEST(ImportBudget, TheEnvironmentAllowsMore) {
  ASSERT_EQ(::setenv("KILN_IMPORT_MIB", "2000", 1), 0);
  ImportBudget more("x.glb", 0);
  EXPECT_TRUE(more.take(2000 * kMiB, "its meshes"));
  EXPECT_FALSE(more.take(1, "its meshes"));
  for (const char* word : {"", "some", "-1", "2000 MiB", "7"}) {
    ::setenv("KILN_IMPORT_MIB", word, 1);
    ImportBudget plain("x.glb", 0);
    EXPECT_TRUE(plain.take(ImportBudget::kAnyFile, "its meshes")) << word;
    EXPECT_FALSE(plain.take(1, "its meshes")) << word;
  }
  ::unsetenv("KILN_IMPORT_MIB");
}

TEST(ImportBudget, InstancesWithoutDataAreCountedBeforeTheyAreMade) {
  EXPECT_EQ(imported(instanced(5000)).scene.instances.size(), 5000u);
  const uint64_t before = peak_bytes();
  EXPECT_SAYS(refused(instanced(1 << 24)), "the places of EXT_mesh_gpu_instancing would take more memory");
  EXPECT_SAYS(refused(instanced(4294967295u)), "accessors without a buffer view would take more memory");
  EXPECT_LT(peak_bytes() - before, 1200 * kMiB);
}

TEST(ImportBudget, ALongNameCountsForEveryObject) {
  GltfBuilder b = instanced(4096);
  b.root["nodes"][0]["name"] = std::string(kMiB, 'n');
  const std::string message = refused(b);
  EXPECT_SAYS(message, "its objects, counted wherever they stand, would take more memory");
  EXPECT_LT(message.size(), 1000u);
}

TEST(ImportBudget, ABufferFileIsReadOnceHoweverOftenItIsNamed) {
  test::TempDir dir;
  GltfBuilder b = test::small_scene();
  const fs::path scene = test::write_gltf_file(b, dir.path());
  const auto bytes = read_file(scene);
  json root = json::parse(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
  ASSERT_TRUE(write_file_atomic(dir.path() / "mib.bin", std::string(kMiB, 'x')));
  fs::create_directory(dir.path() / "in");
  for (int i = 0; i < 10'000; ++i)
    root["buffers"].push_back({{"uri", i % 2 ? "mib.bin" : "in/../mib.bin"}, {"byteLength", kMiB}});
  ASSERT_TRUE(write_file_atomic(scene, root.dump()));
  const auto document = read_gltf_document(scene);
  ASSERT_TRUE(document) << document.error().message;
  ASSERT_EQ(document->buffers.size(), 10'001u);
  for (size_t i = 2; i < document->buffers.size(); ++i)
    ASSERT_EQ(document->buffers[i], document->buffers[1]) << i;
}

TEST(ImportBudget, AFileOfHolesIsNoLargeScene) {
  test::TempDir dir;
  const fs::path scene = test::write_gltf_file(test::small_scene(), dir.path());
  fs::resize_file(dir.path() / "x.bin", 3000 * kMiB);
  EXPECT_SAYS(message_of(read_gltf_document(scene)), "buffer 'x.bin' would take more memory");
}

TEST(ImportBudget, JsonIsWeighedBeforeItIsParsed) {
  test::TempDir dir;
  std::string nodes = "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{}";
  for (int i = 1; i < 4'000'000; ++i) nodes += ",{}";
  ASSERT_TRUE(write_file_atomic(dir.path() / "x.gltf", nodes + "]}"));
  const uint64_t before = peak_bytes();
  EXPECT_SAYS(message_of(read_gltf_document(dir.path() / "x.gltf")), "its JSON would take more memory");
  EXPECT_LT(peak_bytes() - before, 200 * kMiB);
}

TEST(ImportBudget, TheWeightOfJsonGrowsWithItsParts) {
  const auto weight = [](const std::string& text) { return weigh_json(text).bytes; };
  EXPECT_GT(weight(R"({"materials":[{}]})"), weight(R"({"nodes":[{}]})"));
  EXPECT_GT(weight(R"({"nodes":[{"extras":[1,2]}]})"), weight(R"({"nodes":[{"matrix":[1,2]}]})"));
  // Only what is inside of an extension weighs as one.
  const uint64_t plain = weight(R"({"b":[1,2,3]})") - weight(R"({"b":[]})");
  EXPECT_EQ(weight(R"({"extras":{"a":[]},"b":[1,2,3]})") - weight(R"({"extras":{"a":[]},"b":[]})"), plain);
  EXPECT_EQ(weight(R"({"extras":1,"b":[1,2,3]})") - weight(R"({"extras":1,"b":[]})"), plain);
  EXPECT_FALSE(weigh_json(std::string(128, '[') + std::string(128, ']')).too_deep);
  EXPECT_TRUE(weigh_json(std::string(129, '[')).too_deep);
  EXPECT_EQ(weigh_json("{}").bad_at, 0u);
  EXPECT_EQ(weigh_json("{},").bad_at, 3u);
}

// A parser that looks back at all earlier elements for each takes hours for this one.
TEST(ImportBudget, AMillionEmptyNodesAreRead) {
  test::TempDir dir;
  constexpr int kNodes = 1'000'000;
  std::string nodes, roots;
  for (int i = 0; i < kNodes; ++i) {
    nodes += i ? ",{}" : "{\"mesh\":0}";
    roots += (i ? "," : "") + std::to_string(i);
  }
  const GltfBuilder b = test::small_scene();
  json root = b.root;
  root["buffers"] = {{{"uri", "x.bin"}, {"byteLength", b.buffer.size()}}};
  root["nodes"] = "NODES";
  root["scenes"][0]["nodes"] = "ROOTS";
  std::string file = root.dump();
  file.replace(file.find("\"NODES\""), 7, "[" + nodes + "]");
  file.replace(file.find("\"ROOTS\""), 7, "[" + roots + "]");
  ASSERT_TRUE(write_file_atomic(dir.path() / "x.bin", b.buffer));
  ASSERT_TRUE(write_file_atomic(dir.path() / "x.gltf", file));
  const auto scene = import_scene(dir.path() / "x.gltf", {});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->scene.instances.size(), 1u);
}

// Four bytes, most significant first.
void put_word(Bytes& file, size_t at, uint32_t word) {
  for (int k = 0; k < 4; ++k)
    file[at + static_cast<size_t>(k)] = static_cast<std::byte>(word >> (24 - 8 * k));
}

// A PNG whose header says another size. What follows does not matter: nothing of it is decoded.
Bytes png_that_says(uint32_t side) {
  Bytes file = test::small_png(10, 20, 30);
  put_word(file, 16, side);
  put_word(file, 20, side);
  uint32_t crc = ~0u;  // of the IHDR chunk's name and data
  for (size_t i = 12; i < 29; ++i) {
    crc ^= static_cast<uint32_t>(file[i]);
    for (int k = 0; k < 8; ++k) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
  }
  put_word(file, 29, ~crc);
  return file;
}

TEST(ImportBudget, AnImageOfNothingIsNotDecoded) {
  const uint64_t before = peak_bytes();
  EXPECT_SAYS(message_of(decode_image(png_that_says(16384), "x.png")),
              "x.png: 16384 x 16384 texels would take 768 MiB, more than a file of 1 KiB may take");
  Bytes large = png_that_says(16384);
  large.resize(9 * kMiB);
  EXPECT_SAYS(message_of(decode_image(large, "x.png")), "does not decode") << "its size is none to refuse";
  EXPECT_LT(peak_bytes() - before, 900 * kMiB);
  GltfBuilder b;
  for (int i = 0; i < 6; ++i)
    b.textured_triangle(
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", b.image(png_that_says(16384))}}}}}});
  EXPECT_SAYS(note_with(imported(b), "image 5"), "scale it down");
}

// Not with nothing to hold: beside that, what is larger than the gate is still alone.
TEST(ImportBudget, AGateHoldsNoMoreThanItMay) {
  MemoryGate gate(100);
  std::atomic<uint64_t> held{0};
  std::atomic<bool> crowded{false};
  const auto hold = [&](uint64_t bytes) {
    MemoryGate::Hold mine(gate);
    mine.take(bytes);
    const uint64_t together = held += bytes;
    crowded = crowded || (together > 100 && together != bytes);
    std::this_thread::yield();
    held -= bytes;
  };
  std::vector<std::thread> threads;
  for (uint64_t t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (uint64_t i = 0; i < 500; ++i) hold(1 + (i * 37 + t * 11) % 149);  // above 100: alone
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(crowded);
}

}  // namespace
}  // namespace kiln
