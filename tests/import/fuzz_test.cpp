// Damaged files must fail or import, never crash. Run it in a sanitizer tree too (KILN_SANITIZE).
#include <fstream>
#include <random>

#include "common/base/files.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::json;

void damage(Bytes& file, std::mt19937& random) {
  const size_t edits = 1 + random() % 4;
  for (size_t e = 0; e < edits && !file.empty(); ++e) {
    const size_t at = random() % file.size();
    switch (random() % 5) {
      case 0:
        file[at] = static_cast<std::byte>(random());
        break;
      case 1:  // a digit or bracket: the JSON often stays JSON
        file[at] = static_cast<std::byte>("0123456789-{}[],:\"."[random() % 19]);
        break;
      case 2:
        file[at] ^= static_cast<std::byte>(1u << random() % 8);
        break;
      case 3:
        file.resize(at);
        break;
      default:
        for (size_t i = at; i < std::min(file.size(), at + 4); ++i) file[i] = std::byte{0xff};
    }
  }
}

// Replaces one number somewhere in the tree by another.
void damage_number(json& root, std::mt19937& random) {
  std::vector<json*> numbers, open{&root};
  while (!open.empty()) {
    json* at = open.back();
    open.pop_back();
    if (at->is_number()) numbers.push_back(at);
    if (at->is_structured())
      for (auto& child : *at) open.push_back(&child);
  }
  static const json kValues[] = {0,      1,      -1,           2,       3,          255,
                                 5121,   5125,   5126,         1000000, 2147483647, -2147483648ll,
                                 1e38,   1e-300, 4294967296ll, 0.5,     1e308,      18446744073709551615ull,
                                 "word", nullptr};
  *numbers[random() % numbers.size()] = kValues[random() % std::size(kValues)];
}

// Imports and holds what comes out to the scene's contract (import does so itself, by check_scene).
bool survives(const std::filesystem::path& path) {
  const auto result = import_scene(path, {});
  if (!result) EXPECT_FALSE(result.error().message.empty());
  return result.has_value();
}

TEST(Fuzz, DamagedBytes) {
  test::TempDir dir;
  const auto path = test::write_glb_file(test::rich_scene(), dir.path());
  const Bytes whole = read_file(path).value();
  ASSERT_TRUE(survives(path)) << import_scene(path, {}).error().message;
  size_t good = 0;
  for (uint32_t seed = 0; seed < 2500; ++seed) {
    std::mt19937 random(seed);
    Bytes file = whole;
    damage(file, random);
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
    SCOPED_TRACE(seed);
    good += survives(path);
  }
  EXPECT_GT(good, 100u) << "nearly every damage is refused at the door: the fuzzer reaches nothing";
}

TEST(Fuzz, DamagedNumbers) {
  test::TempDir dir;
  size_t good = 0;
  for (uint32_t seed = 0; seed < 2000; ++seed) {
    std::mt19937 random(seed);
    GltfBuilder b = test::rich_scene();
    for (uint32_t i = 0; i < 1 + seed % 3; ++i) damage_number(b.root, random);
    SCOPED_TRACE(seed);
    const std::string json_text = [&] {
      json root = b.root;
      root["buffers"] = {{{"byteLength", b.buffer.size()}}};
      return root.dump();
    }();
    const Bytes glb = write_glb(json_text, b.buffer);
    const auto path = dir.path() / "x.glb";
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(glb.data()), static_cast<std::streamsize>(glb.size()));
    good += survives(path);
  }
  EXPECT_GT(good, 300u);
}

}  // namespace
}  // namespace kiln
