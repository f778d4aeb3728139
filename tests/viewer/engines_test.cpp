// scene_unlit.glb and scene.glb in engines as npm has them, against the renderer of preview.png: same camera,
// exposure and curve, and as many samples a pixel, which engines take by a larger picture. scene_unlit.glb is
// loaded by the engine alone, scene.glb with the loader of docs/examples.
#include <nlohmann/json.hpp>

#include "common/base/files.h"
#include "coordinator/output/look/surface_look.h"
#include "coordinator/picture/raster.h"
#include "coordinator/report/preview.h"
#include "coordinator/scene/document/gltf_document.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/viewer/node_tools.h"
#include "tests/viewer/published.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

constexpr uint32_t kWidth = 480, kHeight = 270;
constexpr uint32_t kSampledWidth = kWidth * kSupersample, kSampledHeight = kHeight * kSupersample;
// Of 255, over pixels inside surfaces: the mean of their differences, and how close half of them must be.
constexpr double kMostMean = 2, kMostMedian = 2;

struct Reference {
  Picture picture;
  std::vector<bool> surface;  // by pixel: shows one alone, not the sky, which no file has, nor a silhouette
};

// Whether the samples around number i lie on a surface that goes on: depths within a twentieth.
bool is_inside_surface(const View& view, size_t i) {
  const auto x = static_cast<int64_t>(i % view.width), y = static_cast<int64_t>(i / view.width);
  const float own = view.fragments[i].inverse_depth;
  if (own == 0 || x == 0 || y == 0 || x + 1 == view.width || y + 1 == view.height) return false;
  for (int64_t dy = -1; dy <= 1; ++dy)
    for (int64_t dx = -1; dx <= 1; ++dx) {
      const float other = view.fragments[static_cast<size_t>((y + dy) * view.width + x + dx)].inverse_depth;
      if (!(std::abs(other - own) <= 0.05f * own)) return false;
    }
  return true;
}

Reference render(const test::Published& p, float exposure, bool filmic) {
  ViewStyle style;
  style.exposure = exposure;
  style.filmic = filmic;
  const Camera& camera = p.imported.cameras.front();
  Reference out{render_view(p.imported, p.atlas, p.map, camera, kWidth, kHeight, style), {}};
  const SurfaceLook look(p.imported.scene, p.atlas, p.map);
  const View view = rasterise(p.imported.scene, camera, kSampledWidth, kSampledHeight,
                              [&](const Fragment& f) { return look.visible(f); });
  out.surface.assign(size_t{kWidth} * kHeight, true);
  for (size_t i = 0; i < view.fragments.size(); ++i)
    if (!is_inside_surface(view, i))
      out.surface[i / kSampledWidth / kSupersample * kWidth + i % kSampledWidth / kSupersample] = false;
  return out;
}

struct Difference {
  size_t pixels = 0;
  double mean = 0, median = 0;  // of 255: of the three channels' mean
};

Difference compare(const Reference& ours, const Picture& theirs) {
  std::vector<double> all;
  for (size_t i = 0; i < ours.surface.size(); ++i) {
    if (!ours.surface[i]) continue;
    double sum = 0;
    for (size_t c = 0; c < 3; ++c)
      sum += std::abs(static_cast<double>(ours.picture.rgb[3 * i + c]) -
                      static_cast<double>(theirs.rgb[3 * i + c]));
    all.push_back(sum / 3);
  }
  Difference d{all.size(), 0, 0};
  for (const double x : all) d.mean += x / static_cast<double>(std::max<size_t>(1, all.size()));
  std::sort(all.begin(), all.end());
  if (!all.empty()) d.median = all[all.size() / 2];
  return d;
}

class Engines : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto why = test::no_engines()) GTEST_SKIP() << *why;
    fs::create_directories(pictures_);
    BakeRequest request;
    request.scene = test::source_dir() / "tests/scenes/arcade/arcade.gltf";
    request.output = out_;
    request.worker_program = test::binary_dir() / "bin/kiln-worker";
    request.settings.layout = "pack";
    request.settings.texels_per_metre = 8;
    request.settings.min_samples = request.settings.max_samples = 16;
    request.settings.encodings = {"rgbm"};  // as configs/engines/playcanvas.json
    request.settings.encode_quantity = "irradiance";
    request.settings.encode_units = "e-over-pi";
    const auto report = run_bake(request, [](const BakeProgress&) {});
    ASSERT_TRUE(report) << report.error().message;
    auto published = test::read_published(request.scene, request.settings, out_);
    ASSERT_TRUE(published) << published.error().message;
    published_ = std::move(*published);
    ASSERT_FALSE(published_.imported.cameras.empty());
    const auto unlit = read_gltf_document(out_ / "scene_unlit.glb");
    ASSERT_TRUE(unlit);
    exposure_ = nlohmann::json::parse(unlit->json)["extras"]["kiln"]["exposure"];
  }

  std::string command_of(const std::string& engine, const std::string& file, const fs::path& shot,
                         const std::string& exposure, const std::string& material) const {
    const std::string size = std::to_string(kSampledWidth) + " " + std::to_string(kSampledHeight);
    if (engine == "blender")
      return "blender -b --factory-startup --python '" +
             (test::source_dir() / "tests/node/engines/blender_shot.py").string() + "' -- '" +
             (out_ / file).string() + "' " + size + " '" + shot.string() + "'";
    return test::node_script("engines/engine_shot.mjs") + " " + engine + " '" + out_.string() + "' " + file +
           " " + size + " '" + shot.string() + "' '" + exposure + "' " + material;
  }

  // `material`: of three.js, in place of diffuse light alone, whose mean alone is held to the limit.
  void show(const std::string& engine, const std::string& file, const Reference& ours,
            const std::string& exposure, const std::string& material = "") {
    SCOPED_TRACE(engine + " " + file + " " + material);
    const fs::path shot = pictures_ / (engine + material + "_" + file + ".png");
    const auto browser = test::run_command(command_of(engine, file, shot, exposure, material));
    ASSERT_EQ(browser.exit_status, 0) << browser.output;
    const auto theirs = decode_image(*read_file(shot), "screenshot");
    ASSERT_TRUE(theirs);
    ASSERT_TRUE(theirs->width == kSampledWidth && theirs->height == kSampledHeight);
    const Picture shown = supersampled(kWidth, kHeight, kSupersample, [&](size_t i) {
      const std::byte* c = &theirs->texels[theirs->channels * i];
      return Vec3(static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2]));
    });
    ASSERT_TRUE(write_png(shot, kWidth, kHeight, shown.rgb));
    const Difference d = compare(ours, shown);
    std::printf("| %s %s | `%s` | %.2f | %.2f |\n", engine.c_str(), material.c_str(), file.c_str(), d.mean,
                d.median);
    EXPECT_GT(d.pixels, kWidth * kHeight * 3 / 4);
    EXPECT_LT(d.median, kMostMedian);
    if (material.empty()) EXPECT_LT(d.mean, kMostMean);
  }

  const fs::path pictures_ = test::binary_dir() / "engines_test";
  test::TempDir dir_;
  const fs::path out_ = dir_.path() / "out";
  test::Published published_;
  float exposure_ = 1;
};

TEST_F(Engines, ShowTheLightOfTheFiles) {
  const Reference unlit = render(published_, exposure_, true);
  ASSERT_TRUE(write_png(pictures_ / "reference_scene_unlit.glb.png", kWidth, kHeight, unlit.picture.rgb));
  for (const char* engine : {"three", "babylon", "playcanvas"}) show(engine, "scene_unlit.glb", unlit, "");
  if (test::run_command("blender --version").exit_status == 0)
    show("blender", "scene_unlit.glb", unlit, "");
  else
    std::printf("there is no Blender: apt install blender\n");
  const Reference lit = render(published_, exposure_, false);
  ASSERT_TRUE(write_png(pictures_ / "reference_scene.glb.png", kWidth, kHeight, lit.picture.rgb));
  for (const char* engine : {"three", "babylon", "playcanvas"})
    show(engine, "scene.glb", lit, std::to_string(exposure_));
  show("three", "scene.glb", lit, std::to_string(exposure_), "standard");
}

}  // namespace
}  // namespace kiln
