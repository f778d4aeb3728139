// One room with a sun, a lamp, a normal map, holes of alpha and instances, baked once and shown by every
// program: each picture against the renderer of preview.png. KILN_WRITE_DOCS=1 writes the table of
// docs/engines.md; tests/node/side_by_side.mjs makes its picture of what lies in build/one_scene.
#include <nlohmann/json.hpp>

#include "common/base/files.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/support/doc_table.h"
#include "tests/viewer/node_tools.h"
#include "tests/viewer/programs.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

// Of 255, over pixels inside surfaces: the mean of their differences, and how close half of them must be.
constexpr double kMostMean = 2, kMostMedian = 2;

const fs::path scene = test::source_dir() / "tests/scenes/room/room.gltf";

// How a program shows the baked folder in `shot`.
struct Program {
  std::string name, light;
  std::optional<std::string> (*missing)();
  std::function<std::string()> version;
  std::function<test::CommandResult(const fs::path& folder, const fs::path& work, const fs::path& shot)> show;
};

Program engine(const std::string& label, const std::string& name, const std::string& light) {
  return {label, light, test::no_engines, [name] { return test::version_of_engine(name); },
          [name](const fs::path& folder, const fs::path&, const fs::path& shot) {
            return test::show_in_engine(name, folder, "scene.glb", shot, "1", "");
          }};
}

Program godot(const std::string& driver, const std::string& light) {
  return {"Godot, " + driver, light, test::no_godot, test::version_of_godot,
          [driver](const fs::path& folder, const fs::path& work, const fs::path& shot) {
            return test::show_in_godot(folder, driver, work, shot);
          }};
}

std::vector<Program> programs() {
  return {engine("three.js", "three", "`irradiance.exr`"),
          engine("Babylon.js", "babylon", "`lightmap_rgbd_E.png`"),
          engine("PlayCanvas", "playcanvas", "`lightmap_rgbm_E.png`"),
          {"Blender, Cycles", "`irradiance.exr`", test::no_blender, test::version_of_blender,
           [](const fs::path& folder, const fs::path&, const fs::path& shot) {
             return test::show_in_add_on(scene, folder, shot);
           }},
          godot("GLES3", "`lightmap_E.exr`"),
          godot("GLES2", "`lightmap_E.exr`, coded in 8 bits")};
}

// What the scene is for, so that none of it gets lost.
void expect_features(const ImportResult& imported) {
  std::map<std::string, int> lights;
  for (const Record& light : imported.scene.lights) ++lights[light.type];
  EXPECT_EQ(lights["directional"], 1);
  EXPECT_EQ(lights["point"], 1);
  std::map<uint32_t, int> uses;
  for (const auto& instance : imported.scene.instances) ++uses[instance.mesh];
  EXPECT_EQ(std::count_if(uses.begin(), uses.end(), [](const auto& use) { return use.second > 1; }), 2);
  const auto has = [&](const std::string& property) {
    return std::any_of(imported.scene.materials.begin(), imported.scene.materials.end(),
                       [&](const Record& m) { return m.find(property) != nullptr; });
  };
  EXPECT_TRUE(has("normal_texture"));
  EXPECT_TRUE(has("alpha_cutoff"));
}

TEST(OneScene, LooksTheSameInEveryProgram) {
  const std::vector<Program> all = programs();
  if (std::all_of(all.begin(), all.end(), [](const Program& p) { return p.missing().has_value(); }))
    GTEST_SKIP() << *all.front().missing();
  const test::TempDir dir;
  const fs::path pictures = test::binary_dir() / "one_scene", folder = dir.path() / "out";
  fs::create_directories(pictures);
  const auto published = test::bake_for_programs(scene, 16, folder, 128);
  ASSERT_TRUE(published) << published.error().message;
  expect_features(published->imported);
  const test::Reference ours = test::render_reference(*published, 1, false);
  ASSERT_TRUE(write_png(pictures / "Kiln.png", test::kWidth, test::kHeight, ours.picture.rgb));
  nlohmann::json shown = nlohmann::json::array();
  std::string table = "| program | version | light from | mean, of 255 | median |\n|---|---|---|---|---|\n";
  std::string missing;
  const test::DocTable page("docs/engines.md");
  const bool writes = ::getenv("KILN_WRITE_DOCS") != nullptr;
  for (const Program& program : all) {
    SCOPED_TRACE(program.name);
    if (!writes) EXPECT_FALSE(page.cells_of(program.name).empty()) << "docs/engines.md has no such row";
    if (const auto why = program.missing()) {
      missing += program.name + ": " + *why + "\n";
      continue;
    }
    const fs::path shot = pictures / (program.name + ".png");
    fs::remove(shot);
    const auto done = program.show(folder, dir.path(), shot);
    EXPECT_EQ(done.exit_status, 0) << done.output;
    if (done.exit_status != 0) continue;
    const Picture theirs = test::read_sampled(shot);
    if (theirs.rgb.empty()) continue;
    const test::Difference d = test::compare_pictures(ours, theirs);
    EXPECT_GT(d.pixels, test::kWidth * test::kHeight * 3 / 4);
    EXPECT_LT(d.mean, kMostMean);
    EXPECT_LT(d.median, kMostMedian);
    char numbers[64];
    std::snprintf(numbers, sizeof numbers, "%.2f | %.2f", d.mean, d.median);
    table +=
        "| " + program.name + " | " + program.version() + " | " + program.light + " | " + numbers + " |\n";
    shown.push_back({{"name", program.name}, {"version", program.version()}, {"mean", d.mean}});
  }
  std::printf("%s", table.c_str());
  ASSERT_TRUE(write_file_atomic(pictures / "shown.json", shown.dump(1)));
  if (writes && missing.empty()) ASSERT_TRUE(page.replace(table));
  if (!missing.empty()) GTEST_SKIP() << "not shown in all programs:\n" << missing;
}

}  // namespace
}  // namespace kiln
