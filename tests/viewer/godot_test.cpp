// The import script of configs/engines/godot in Debian's Godot 3.2 under Xvfb: the demo, baked with the
// preset's textures, imported by the editor and shown by both renderers, against the renderer of preview.png.
#include "coordinator/scene/imageio/imageio.h"
#include "tests/viewer/programs.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

constexpr double kMost = 2;  // of 255: mean and median difference over pixels inside surfaces

class Godot : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto why = test::no_godot()) GTEST_SKIP() << *why;
    const fs::path scene = test::source_dir() / "tests/scenes/arcade/arcade.gltf";
    auto published = test::bake_for_programs(scene, 8, dir_.path() / "bake", 16);
    ASSERT_TRUE(published) << published.error().message;
    published_ = std::move(*published);
  }

  Picture show(const std::string& driver) {
    const fs::path shot = dir_.path() / (driver + ".png");
    const auto done = test::show_in_godot(dir_.path() / "bake", driver, dir_.path(), shot);
    EXPECT_EQ(done.exit_status, 0) << done.output;
    return done.exit_status == 0 ? test::read_sampled(shot) : Picture{};
  }

  test::TempDir dir_;
  test::Published published_;
};

TEST_F(Godot, ShowsTheLightOfTheFiles) {
  const test::Reference ours = test::render_reference(published_, 1, false);
  const fs::path pictures = test::binary_dir() / "godot_test";
  fs::create_directories(pictures);
  ASSERT_TRUE(write_png(pictures / "kiln.png", test::kWidth, test::kHeight, ours.picture.rgb));
  for (const char* driver : {"GLES3", "GLES2"}) {
    SCOPED_TRACE(driver);
    const Picture theirs = show(driver);
    ASSERT_FALSE(theirs.rgb.empty());
    ASSERT_TRUE(
        write_png(pictures / (std::string(driver) + ".png"), test::kWidth, test::kHeight, theirs.rgb));
    const test::Difference d = test::compare_pictures(ours, theirs);
    std::printf("| Godot 3.2, %s | %.2f | %.2f | %zu pixels |\n", driver, d.mean, d.median, d.pixels);
    EXPECT_LT(d.mean, kMost);
    EXPECT_LT(d.median, kMost);
  }
}

}  // namespace
}  // namespace kiln
