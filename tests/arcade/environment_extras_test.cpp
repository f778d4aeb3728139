// scenes[i].extras.kiln.environment: an equirectangular image beside the file.
#include <cstring>
#include <fstream>

#include "coordinator/scene/import/import.h"
#include "tests/support/paths.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;
using N = std::vector<double>;

class EnvironmentExtras : public testing::Test {
 protected:
  EnvironmentExtras() {
    std::ofstream sky(dir_.path() / "sky.hdr", std::ios::binary);  // 2 x 1 texels of 0.5, 0.25, 1
    sky << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n";
    for (int i = 0; i < 2; ++i) sky.write("\x40\x20\x80\x81", 4);
  }

  // One triangle; `environment` is the JSON of the extras.
  Expected<ImportResult> import(const std::string& environment, const BakeSettings& settings = {}) {
    const char* head =
        R"({"asset":{"version":"2.0"},"scene":0,"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
        "scenes":[{"nodes":[0],"extras":{"kiln":{"environment":)";
    std::ofstream(dir_.path() / "scene.gltf") << head << environment << "}}}]}";
    return import_scene(dir_.path() / "scene.gltf", settings);
  }
  std::string error(const std::string& environment) {
    const auto result = import(environment);
    return result ? "" : result.error().message;
  }

  const test::TempDir dir_;
};

TEST_F(EnvironmentExtras, IsReadWithStrengthAndRotation) {
  const auto result = import(R"({"image":"sky.hdr","strength":2,"rotation":30})");
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->scene.lights.size(), 1u);
  const Record& light = result->scene.lights[0];
  EXPECT_EQ(light.type, "environment");
  EXPECT_EQ(light.find("radiance")->numbers, (N{2, 2, 2}));
  EXPECT_EQ(light.find("rotation")->numbers, N{30});
  const Texture& image = result->scene.textures[static_cast<size_t>(light.find("image")->texture.texture)];
  EXPECT_EQ(image.width, 2u);
  float first[3];
  std::memcpy(first, image.texels.data(), sizeof(first));
  EXPECT_NEAR(first[0], 0.5f, 0.005f);  // readers differ by half a step of the format
}

TEST_F(EnvironmentExtras, OptionsComeOnTop) {
  BakeSettings settings;
  settings.environment_strength = 3;
  settings.environment_rotation = 15;
  auto result = import(R"({"image":"sky.hdr","strength":2,"rotation":30})", settings);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->scene.lights[0].find("radiance")->numbers, (N{6, 6, 6}));
  EXPECT_EQ(result->scene.lights[0].find("rotation")->numbers, N{45});
  settings.environment = "1,2,3";
  result = import(R"({"image":"sky.hdr"})", settings);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->scene.lights.size(), 1u);
  EXPECT_EQ(result->scene.lights[0].find("image"), nullptr);
}

TEST_F(EnvironmentExtras, MistakesAreNamed) {
  const std::string where = "extras.kiln.environment";
  for (const char* json :
       {R"({"strength":1})", R"({"image":7})", R"({"image":"../sky.hdr"})", R"({"image":"/etc/sky.hdr"})",
        R"({"image":"http://host/sky.hdr"})", R"({"image":"sky.hdr","strength":-1})",
        R"({"image":"sky.hdr","rotation":"half"})"}) {
    EXPECT_NE(error(json).find(where), std::string::npos) << json << ": " << error(json);
    EXPECT_NE(error(json).find("scene.gltf"), std::string::npos) << json;
  }
  EXPECT_NE(error(R"({"image":"none.hdr"})").find("none.hdr"), std::string::npos);
}

}  // namespace
}  // namespace kiln
