// scene_unlit.glb and scene.glb in engines as npm has them, against the renderer of preview.png: same camera,
// exposure and curve, and as many samples a pixel, which engines take by a larger picture. scene_unlit.glb is
// loaded by the engine alone, scene.glb with the modules of configs/engines/web.
#include <nlohmann/json.hpp>

#include "coordinator/scene/document/gltf_document.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/viewer/node_tools.h"
#include "tests/viewer/programs.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

using test::kHeight, test::kWidth, test::Reference;

// Of 255, over pixels inside surfaces: the mean of their differences, and how close half of them must be.
constexpr double kMostMean = 2, kMostMedian = 2;

class Engines : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto why = test::no_engines()) GTEST_SKIP() << *why;
    fs::create_directories(pictures_);
    auto published = test::bake_for_programs(scene_, 8, out_, 16);
    ASSERT_TRUE(published) << published.error().message;
    published_ = std::move(*published);
    ASSERT_FALSE(published_.imported.cameras.empty());
    const auto unlit = read_gltf_document(out_ / "scene_unlit.glb");
    ASSERT_TRUE(unlit);
    exposure_ = nlohmann::json::parse(unlit->json)["extras"]["kiln"]["exposure"];
  }

  // `material`: as engine_shot.mjs has it; three's own takes reflections off the light, so its mean is not
  // held.
  void show(const std::string& engine, const std::string& file, const Reference& ours,
            const std::string& exposure, const std::string& material = "") {
    SCOPED_TRACE(engine + " " + file + " " + material);
    const fs::path shot = pictures_ / (engine + material + "_" + file + ".png");
    const auto done = engine == "blender"
                          ? test::show_in_blender(out_ / file, shot)
                          : test::show_in_engine(engine, out_, file, shot, exposure, material);
    ASSERT_EQ(done.exit_status, 0) << done.output;
    const Picture shown = test::read_sampled(shot);
    ASSERT_FALSE(shown.rgb.empty());
    const test::Difference d = test::compare_pictures(ours, shown);
    std::printf("| %s %s | `%s` | %.2f | %.2f |\n", engine.c_str(), material.c_str(), file.c_str(), d.mean,
                d.median);
    EXPECT_GT(d.pixels, kWidth * kHeight * 3 / 4);
    EXPECT_LT(d.median, kMostMedian);
    if (material != "standard") EXPECT_LT(d.mean, kMostMean);
  }

  const fs::path scene_ = test::source_dir() / "tests/scenes/arcade/arcade.gltf";
  const fs::path pictures_ = test::binary_dir() / "engines_test";
  test::TempDir dir_;
  const fs::path out_ = dir_.path() / "out";
  test::Published published_;
  float exposure_ = 1;
};

TEST_F(Engines, ShowTheLightOfTheFiles) {
  const Reference unlit = test::render_reference(published_, exposure_, true);
  ASSERT_TRUE(write_png(pictures_ / "reference_scene_unlit.glb.png", kWidth, kHeight, unlit.picture.rgb));
  for (const char* engine : {"three", "babylon", "playcanvas"}) show(engine, "scene_unlit.glb", unlit, "");
  if (const auto why = test::no_blender())
    std::printf("%s\n", why->c_str());
  else
    show("blender", "scene_unlit.glb", unlit, "");
  const Reference lit = test::render_reference(published_, exposure_, false);
  ASSERT_TRUE(write_png(pictures_ / "reference_scene.glb.png", kWidth, kHeight, lit.picture.rgb));
  for (const char* engine : {"three", "babylon", "playcanvas"})
    for (const char* light : {"", "moz"}) show(engine, "scene.glb", lit, std::to_string(exposure_), light);
  show("three", "scene.glb", lit, std::to_string(exposure_), "standard");
  // As other programs write it, and nothing else in the file.
  for (const char* light : {"epic", "mx"}) {
    const std::string file = std::string(light) + ".glb";
    const auto done = test::run_kiln(
        dir_.path(), "encode " + scene_.string() + " --from out -o " + light +
                         " --layout pack --texels-per-metre 8 --encode none --gltf-lightmap " + light);
    ASSERT_EQ(done.exit_status, 0) << done.output;
    fs::copy_file(dir_.path() / light / "scene.glb", out_ / file);
    show("three", file, lit, std::to_string(exposure_), light);
  }
}

}  // namespace
}  // namespace kiln
