// Every scene made by others bakes in layout pack without an error, at a low density and few samples, and
// kiln-worker links no image decoder.
#include "coordinator/run/bake_run.h"

namespace kiln {
namespace {

struct SharedScene {
  const char* file;
  double texels_per_metre;  // for 10^3 to 10^5 texels
  const char* sun;          // the lighting of its sidecar
  bool sky;
};

const SharedScene kScenes[] = {
    {"MixedLightingExample.glb", 4, nullptr, false},
    {"bevy_CornellBox.glb", 0.05, nullptr, false},
    {"godot_room.glb", 2, nullptr, true},
    {"living-room.glb", 2, nullptr, true},
    {"pc_house.glb", 2, "0.4,1,0.3:5,4.7,4.2", true},
    {"sponza.glb", 1, "0.25,1,0.1:8,7.5,6.5", true},
    {"sponza_lm.glb", 1, "0.25,1,0.1:8,7.5,6.5", true},
    {"staircase.glb", 1, nullptr, false},
    {"veach-bidir.glb", 2, nullptr, false},
    {"zdm2.glb", 0.7, "0.4,1,0.3:5,4.7,4.2", true},
};

class SharedScenes : public testing::TestWithParam<SharedScene> {};

TEST_P(SharedScenes, Bakes) {
  const auto path = test::shared_scene(GetParam().file);
  if (!path) GTEST_SKIP() << GetParam().file << " is not beside the checkout (or in $KILN_SCENES)";
  test::TempDir dir;
  BakeRequest r;
  r.scene = *path;
  r.output = dir.path() / "out";
  r.worker_program = test::binary_dir() / "bin/kiln-worker";
  r.settings.layout = "pack";
  r.settings.texels_per_metre = GetParam().texels_per_metre;
  r.settings.min_samples = r.settings.max_samples = 16;
  if (GetParam().sky) ASSERT_TRUE(set_option(r.settings, "environment", "1,1,1", "test"));
  if (GetParam().sun) ASSERT_TRUE(set_option(r.settings, "sun", GetParam().sun, "test"));
  const auto report = run_bake(r, [](const BakeProgress&) {});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->farm.nonfinite, 0u);
  EXPECT_GT(report->texels_by_class[static_cast<int>(Validity::kMeasured)], 100u);
  for (const char* file : {"irradiance.exr", "sh_l1.exr", "error.exr", "samples.exr", "validity.exr",
                           "scene.glb", "preview.png", "report.json", "report.html"})
    EXPECT_TRUE(std::filesystem::exists(r.output / file)) << file;
}

INSTANTIATE_TEST_SUITE_P(All, SharedScenes, testing::ValuesIn(kScenes), [](const auto& info) {
  std::string name = info.param.file;
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
});

// Debian's OpenImageIO links libraries by the hundred: it is a module that is loaded with the first image.
TEST(Programs, LinkNeitherOpenImageIONorCurl) {
  for (const char* program : {"kiln", "kiln-worker"}) {
    const auto result = test::run_command("ldd '" + (test::binary_dir() / "bin" / program).string() + "'");
    ASSERT_EQ(result.exit_status, 0);
    EXPECT_EQ(result.output.find("OpenImageIO"), std::string::npos) << program;
    EXPECT_EQ(result.output.find("curl"), std::string::npos) << program;
    const char* own = std::string_view(program) == "kiln" ? "sqlite" : "embree";
    EXPECT_NE(result.output.find(own), std::string::npos) << result.output;
  }
}

}  // namespace
}  // namespace kiln
