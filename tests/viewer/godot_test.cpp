// The import script of configs/engines/godot in Debian's Godot 3.2 under Xvfb: the demo, baked with the
// preset's textures, imported by the editor and shown by both renderers, against the renderer of preview.png.
#include "common/base/files.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/viewer/compare_pictures.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

constexpr double kMost = 2;  // of 255: mean and median difference over pixels inside surfaces

class Godot : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* program : {"godot3", "godot3-runner", "xvfb-run"})
      if (test::run_command(std::string("command -v ") + program).exit_status != 0)
        GTEST_SKIP() << "there is no " << program << ": apt install godot3 godot3-runner xvfb";
    BakeRequest request;
    request.scene = test::source_dir() / "tests/scenes/arcade/arcade.gltf";
    request.output = dir_.path() / "bake";
    request.worker_program = test::binary_dir() / "bin/kiln-worker";
    request.settings.layout = "pack";
    request.settings.texels_per_metre = 8;
    request.settings.min_samples = request.settings.max_samples = 16;
    request.settings.encodings = {"exr"};  // as configs/engines/godot.json
    request.settings.encode_quantity = "irradiance";
    request.settings.encode_units = "e-over-pi";
    const auto report = run_bake(request, [](const BakeProgress&) {});
    ASSERT_TRUE(report) << report.error().message;
    auto published = test::read_published(request.scene, request.settings, request.output);
    ASSERT_TRUE(published) << published.error().message;
    published_ = std::move(*published);
  }

  // A project with the baked scene, imported and shown; the picture.
  Picture show(const std::string& driver) {
    const fs::path project = dir_.path() / driver, files = test::source_dir() / "tests/godot";
    fs::create_directories(project / "out");
    fs::copy(test::source_dir() / "configs/engines/godot/addons", project / "addons",
             fs::copy_options::recursive);
    for (const char* name : {"main.gd", "main.tscn"}) fs::copy(files / name, project / name);
    fs::copy(files / "scene.glb.import", project / "out/scene.glb.import");
    for (const char* name : {"scene.glb", "lightmap_E.exr"})
      fs::copy(dir_.path() / "bake" / name, project / "out" / name);
    const auto settings = read_file(files / "project.godot.in").value();
    std::string text(reinterpret_cast<const char*>(settings.data()), settings.size());
    text.replace(text.find("@DRIVER@"), 8, driver);
    EXPECT_TRUE(write_file_atomic(project / "project.godot", text));
    // The editor of 3.2 may crash when it quits, after it has imported: what it leaves decides.
    const std::string xvfb = "timeout 240 xvfb-run -a -s '-screen 0 1280x1024x24' ",
                      path = " --path '" + project.string() + "'";
    const auto import = test::run_command(xvfb + "godot3" + path + " --editor --quit --video-driver GLES3");
    const fs::path shot = project / "shot.png";
    const auto run = test::run_command("KILN_SHOT='" + shot.string() + "' " + xvfb + "godot3-runner" + path +
                                       " --video-driver " + driver);
    EXPECT_TRUE(fs::exists(shot)) << import.output << run.output;
    return fs::exists(shot) ? test::read_sampled(shot) : Picture{};
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
