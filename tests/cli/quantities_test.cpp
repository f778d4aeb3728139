// --quantities end to end: files, what they hold, and what scene.glb and the report say of them.
#include <algorithm>
#include <fstream>

#include "common/base/files.h"
#include "coordinator/scene/imageio/exr.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

class QuantitiesEndToEnd : public testing::Test {
 protected:
  QuantitiesEndToEnd() { test::write_scene_glb(test::small_room(), dir_.path() / "room.glb"); }

  void bake(const std::string& options) {
    const auto result = test::run_kiln(dir_.path(),
                                       "bake room.glb -o out --quiet --texels-per-metre 4 "
                                       "--min-samples 64 --max-samples 64 " +
                                           options);
    ASSERT_EQ(result.exit_status, 0) << result.output;
  }
  bool has(const char* file) const { return fs::exists(dir_.path() / "out" / file); }
  std::string glb_text() const {
    std::ifstream in(dir_.path() / "out/scene.glb", std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  test::TempDir dir_;
};

TEST_F(QuantitiesEndToEnd, LightAloneIsTheDefault) {
  bake("--encode none");
  EXPECT_TRUE(has("irradiance.exr"));
  for (const char* file : {"ao.exr", "sky.exr", "bent.exr", "error_ao.exr"}) EXPECT_FALSE(has(file)) << file;
  EXPECT_EQ(glb_text().find("occlusionTexture"), std::string::npos);
}

TEST_F(QuantitiesEndToEnd, AllOfThem) {
  bake("--quantities light,ao,sky,bent --ao-distance 0.5 --encode bc6h");
  for (const char* file :
       {"irradiance.exr", "ao.exr", "sky.exr", "bent.exr", "error_ao.exr", "error_sky.exr", "error_bent.exr",
        "lightmap_bc4_ao.dds", "lightmap_bc4_sky.ktx2", "lightmap_bc7_bent.dds", "lightmap_bc6h_L0.dds"})
    EXPECT_TRUE(has(file)) << file;
  const auto ao = read_exr(dir_.path() / "out/ao.exr"), error = read_exr(dir_.path() / "out/error_ao.exr");
  ASSERT_TRUE(ao && error);
  EXPECT_EQ(ao->names, std::vector<std::string>{"Y"});
  // Means of 64 samples whose deviation is at most 0.55 (the variance of cos / (pi p) over an open
  // hemisphere).
  for (const float v : ao->data[0]) EXPECT_TRUE(v >= 0 && v < 1 + 6 * 0.55f / 8) << v;
  EXPECT_GT(*std::max_element(error->data[0].begin(), error->data[0].end()), 0.0f);
  const auto bent = read_exr(dir_.path() / "out/bent.exr");
  ASSERT_TRUE(bent);
  EXPECT_EQ(bent->names, (std::vector<std::string>{"X", "Y", "Z"}));
  const std::string glb = glb_text();
  EXPECT_NE(glb.find("occlusionTexture"), std::string::npos);
  EXPECT_NE(glb.find("\"bent.X\""), std::string::npos);
}

TEST_F(QuantitiesEndToEnd, WithoutLightNoneIsWritten) {
  bake("--quantities ao,bent --encode bc6h");
  for (const char* file : {"ao.exr", "bent.exr", "lightmap_bc4_ao.dds", "preview.png", "report.html"})
    EXPECT_TRUE(has(file)) << file;
  for (const char* file :
       {"irradiance.exr", "sh_l1.exr", "error.exr", "measured.exr", "sky.exr", "lightmap_bc6h_L0.dds"})
    EXPECT_FALSE(has(file)) << file;
  EXPECT_EQ(glb_text().find("MOZ_lightmap"), std::string::npos);
  EXPECT_EQ(glb_text().find("\"quantity\""), std::string::npos);
}

// The denoiser fills texels inside geometry with light, which says nothing about what they see.
TEST_F(QuantitiesEndToEnd, TheDenoiserChangesNoResponse) {
  std::vector<Bytes> files;
  for (const char* denoise : {"on", "off"}) {
    bake(std::string("--quantities light,ao,bent --encode none --contact-cuts off --denoise ") + denoise);
    for (const char* file : {"ao.exr", "bent.exr", "error_ao.exr"}) {
      const auto bytes = read_file(dir_.path() / "out" / file);
      ASSERT_TRUE(bytes) << file;
      files.push_back(*bytes);
    }
  }
  for (size_t k = 0; k < 3; ++k) EXPECT_TRUE(files[k] == files[k + 3]) << k;
}

TEST_F(QuantitiesEndToEnd, EncodedAgainTheyAreTheSame) {
  bake("--quantities light,ao,bent --encode bc6h");
  const auto before = read_file(dir_.path() / "out/lightmap_bc4_ao.dds");
  const auto result =
      test::run_kiln(dir_.path(), "encode room.glb --from out -o again --encode bc6h --quiet");
  ASSERT_EQ(result.exit_status, 0) << result.output;
  for (const char* file : {"lightmap_bc4_ao.dds", "lightmap_bc7_bent.ktx2", "ao.exr"}) {
    const auto a = read_file(dir_.path() / "out" / file), b = read_file(dir_.path() / "again" / file);
    ASSERT_TRUE(a && b) << file;
    EXPECT_TRUE(*a == *b) << file;
  }
}

}  // namespace
}  // namespace kiln
