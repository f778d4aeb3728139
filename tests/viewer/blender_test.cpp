// The add-on of configs/engines/blender in a Blender without window, case by case
// (tests/blender/addon_tests.py), and what its preview shows in Cycles against the renderer of preview.png.
#include <csignal>
#include <fstream>
#include <thread>

#include "common/base/files.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/viewer/programs.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

constexpr double kMost = 2;  // of 255: mean and median difference over pixels inside surfaces

class BlenderAddOn : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (const auto why = test::no_blender()) GTEST_SKIP() << *why;
    fs::create_directories(dir_.path() / "scripts/addons");
  }

  test::CommandResult run(const std::string& name) const {
    const std::string folder = dir_.path().string();
    return test::run_command("BLENDER_USER_SCRIPTS='" + folder +
                             "/scripts' blender -b --factory-startup --python-exit-code 1 -P '" +
                             (test::source_dir() / "tests/blender/addon_tests.py").string() + "' -- " + name +
                             " '" + folder + "' '" + (test::binary_dir() / "bin/kiln").string() + "'");
  }

  // Holds a picture of the add-on's preview against the published light.
  void compare(const std::string& name, const BakeSettings& settings) {
    const fs::path folder = dir_.path() / name;
    const auto published = test::read_published(folder / "input.glb", settings, folder / "out");
    ASSERT_TRUE(published) << published.error().message;
    const test::Reference ours = test::render_reference(*published, 1, false);
    const Picture theirs = test::read_sampled(dir_.path() / (name + ".png"));
    ASSERT_FALSE(theirs.rgb.empty());
    const fs::path pictures = test::binary_dir() / "blender_test";
    fs::create_directories(pictures);
    ASSERT_TRUE(write_png(pictures / (name + "_kiln.png"), test::kWidth, test::kHeight, ours.picture.rgb));
    ASSERT_TRUE(write_png(pictures / (name + "_blender.png"), test::kWidth, test::kHeight, theirs.rgb));
    const test::Difference d = test::compare_pictures(ours, theirs);
    std::printf("| Blender add-on, %s | %.2f | %.2f | %zu pixels |\n", name.c_str(), d.mean, d.median,
                d.pixels);
    EXPECT_GT(d.pixels, test::kWidth * test::kHeight / 2);
    EXPECT_LT(d.mean, kMost);
    EXPECT_LT(d.median, kMost);
  }

  test::TempDir dir_;
};

TEST_P(BlenderAddOn, Case) {
  const auto done = run(GetParam());
  ASSERT_EQ(done.exit_status, 0) << done.output;
  BakeSettings settings;
  settings.layout = "pack";
  settings.texels_per_metre = 8;
  if (GetParam() == std::string("room")) compare("room", settings);
  settings.layout = "atlas";
  settings.width = settings.height = 256;
  if (GetParam() == std::string("atlas")) compare("atlas", settings);
}

// Whether the process goes on: not gone, nor a zombie that nobody has asked about.
bool runs(long process) {
  std::ifstream stat("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  std::getline(stat, text);
  const size_t name_end = text.rfind(')');
  return name_end != std::string::npos && text.compare(name_end + 2, 1, "Z") != 0;
}

class KilledBlender : public BlenderAddOn {};

TEST_P(KilledBlender, TakesItsBakeAlong) {
  const auto done = run(GetParam());
  EXPECT_NE(done.exit_status, 0) << done.output;
  long process = 0;
  std::ifstream(dir_.path() / "killed.pid") >> process;
  ASSERT_GT(process, 1) << done.output;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (runs(process) && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(runs(process));
  if (runs(process)) ::kill(static_cast<pid_t>(process), SIGTERM);
}

INSTANTIATE_TEST_SUITE_P(, KilledBlender, testing::Values("killed"),
                         [](const auto& info) { return std::string(info.param); });
INSTANTIATE_TEST_SUITE_P(, BlenderAddOn,
                         testing::Values("room", "lamps", "atlas", "cancel", "failures", "farm", "large"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace kiln
