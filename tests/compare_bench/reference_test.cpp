// References are baked once, told apart by what went in, and refused when damaged.
#include "coordinator/bench/reference.h"

#include <fstream>

#include "coordinator/compare/measures.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

class References : public testing::Test {
 protected:
  References() {
    test::write_scene_glb(test::small_room(), dir_.path() / "room.glb");
    request_.scene = dir_.path() / "room.glb";
    request_.settings.layout = "pack";
    request_.settings.texels_per_metre = 2;
    request_.settings.workers = request_.settings.threads = 1;
    request_.settings.unwrap_cache = "off";
    request_.samples = 4;
    request_.folder = dir_.path() / "references";
    request_.worker_program = test::binary_dir() / "bin/kiln-worker";
  }
  Expected<Reference> obtain() {
    return obtain_reference(request_, [](const BakeProgress&) {});
  }

  test::TempDir dir_;
  ReferenceRequest request_;
};

TEST_F(References, AreBakedOnceAndByWhatMatters) {
  const auto first = obtain();
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_FALSE(first->reused);
  EXPECT_TRUE(compare_maps(first->half[0], first->half[1], nullptr, {}));
  EXPECT_NE(first->half[0].light, first->half[1].light);
  request_.settings.error = 0.3;  // what a reference does not ask
  request_.settings.cache = true;
  request_.settings.seed = 5;
  request_.settings.sampler = "halton";
  const auto again = obtain();
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->reused);
  EXPECT_EQ(again->key, first->key);
  EXPECT_EQ(again->half[1].light, first->half[1].light);
  request_.settings.max_bounces = 1;
  const auto other = obtain();
  ASSERT_TRUE(other);
  EXPECT_NE(other->key, first->key);
  // Nothing but the two: no leftovers of the making.
  const auto entries = std::filesystem::directory_iterator(request_.folder);
  EXPECT_EQ(std::distance(begin(entries), end(entries)), 2);
}

TEST_F(References, DamageIsRefusedWithTheWayOut) {
  const auto first = obtain();
  ASSERT_TRUE(first);
  const auto says = [&](const std::string& what) {
    const auto r = obtain();
    return !r && r.error().message.find(what) != std::string::npos &&
           r.error().message.find("Remove that folder") != std::string::npos;
  };
  const std::filesystem::path map = first->folder / "half1/irradiance.exr",
                              table = first->folder / "reference.json";
  const std::filesystem::path kept = dir_.path() / "kept.exr", kept_table = dir_.path() / "kept.json";
  std::filesystem::copy_file(map, kept);
  std::filesystem::copy_file(table, kept_table);
  std::fstream(map, std::ios::in | std::ios::out).seekp(400).put('\x55');
  EXPECT_TRUE(says("half1/irradiance.exr is not what was written"));
  std::filesystem::remove(map);
  EXPECT_TRUE(says("irradiance.exr"));
  std::filesystem::copy_file(kept, map);
  EXPECT_TRUE(obtain()->reused);
  std::ofstream(table) << R"({"identity": "another", "files": {}})";
  EXPECT_TRUE(says("of another reference"));
  std::ofstream(table) << "{";
  EXPECT_TRUE(says("reference.json"));
  std::filesystem::remove(table);
  EXPECT_TRUE(says("reference.json"));
}

}  // namespace
}  // namespace kiln
