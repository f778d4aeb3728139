// References are baked once, told apart by what went in, and refused when damaged.
#include "coordinator/measure/bench/reference.h"

#include <fstream>

#include "coordinator/measure/compare/measures.h"
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

TEST_F(References, OfAShareHaveTheSameBlocksInBothHalves) {
  request_.settings.texels_per_metre = 12;
  request_.share = 0.3;
  const auto some = obtain();
  ASSERT_TRUE(some) << some.error().message;
  EXPECT_EQ(some->half[0].measured, some->half[1].measured);
  EXPECT_NE(some->half[0].light, some->half[1].light);
  const ErrorMap& m = some->half[0];
  size_t measured = 0;
  for (size_t t = 0; t < m.measured.size(); ++t) {
    if (!m.measured[t]) continue;
    ++measured;
    EXPECT_TRUE(is_reference_block(static_cast<uint32_t>(t % m.width) / kReferenceBlock,
                                   static_cast<uint32_t>(t / m.width) / kReferenceBlock, 0.3))
        << t;
  }
  request_.share = 1;
  const auto whole = obtain();
  ASSERT_TRUE(whole);
  EXPECT_NE(whole->key, some->key);
  const auto all =
      static_cast<size_t>(std::count(whole->half[0].measured.begin(), whole->half[0].measured.end(), true));
  EXPECT_GT(measured, all / 10);
  EXPECT_LT(measured, all / 2);
  // Texels of a share are those of the whole: other texels change nothing of theirs.
  for (size_t t = 0; t < m.measured.size(); ++t)
    if (m.measured[t]) ASSERT_EQ(m.light[t], whole->half[0].light[t]) << t;
  EXPECT_EQ(compare_maps(whole->half[0], some->half[1], nullptr, {})->texels, measured);
  request_.share = 0.3;
  request_.cache = true;
  EXPECT_NE(obtain().error().message.find("--reference-share"), std::string::npos);
}

TEST_F(References, WithAnErrorSpendMoreWhereTheyErrMore) {
  request_.samples = 512;
  request_.settings.error = 0.7;  // of the measured runs
  const auto fixed = obtain();
  ASSERT_TRUE(fixed) << fixed.error().message;
  request_.error = 0.05;
  const BakeSettings s = reference_settings(request_, 0);
  EXPECT_EQ(s.min_samples, 32u);
  EXPECT_EQ(s.max_samples, 512u);
  EXPECT_EQ(s.error, 0.05);
  EXPECT_EQ(s.error_norm, "mean-square");
  const auto fewer = obtain();
  ASSERT_TRUE(fewer) << fewer.error().message;
  EXPECT_NE(fewer->key, fixed->key);
  // Of fewer samples than the fixed ones, and enough for the error: two halves differ by sqrt(2) times it.
  const auto fixed_halves = compare_maps(fixed->half[0], fixed->half[1], nullptr, {}),
             halves = compare_maps(fewer->half[0], fewer->half[1], nullptr, {});
  ASSERT_TRUE(fixed_halves && halves);
  EXPECT_GT(halves->rel_mse, fixed_halves->rel_mse);
  const double asked = 0.05 / 1.96;
  EXPECT_LT(halves->rel_mse, 2 * 2 * asked * asked);
}

TEST_F(References, ABlockOfASmallShareIsOneOfALargeShare) {
  size_t small = 0, large = 0;
  for (uint32_t y = 0; y < 100; ++y)
    for (uint32_t x = 0; x < 100; ++x) {
      small += is_reference_block(x, y, 0.03);
      large += is_reference_block(x, y, 0.5);
      if (is_reference_block(x, y, 0.03)) EXPECT_TRUE(is_reference_block(x, y, 0.5));
    }
  EXPECT_NEAR(small, 300, 5 * std::sqrt(300.0));
  EXPECT_NEAR(large, 5000, 5 * std::sqrt(2500.0));
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
