// --keep-layout from bake to bake: an object more, and what was there keeps its place.
#include "common/base/files.h"
#include "coordinator/run/bake_run.h"
#include "tests/bake/scene_gltf.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::json;

class KeepLayout : public testing::Test {
 protected:
  BakeReport bake(const Scene& scene, const std::string& name, const std::string& keep = "",
                  bool cuts = true) {
    test::write_scene_glb(scene, dir_.path() / (name + ".glb"));
    BakeRequest r;
    r.scene = dir_.path() / (name + ".glb");
    r.output = dir_.path() / name;
    r.worker_program = test::binary_dir() / "bin/kiln-worker";
    r.settings.layout = "pack";
    r.settings.texels_per_metre = 2;
    r.settings.power_of_two = true;  // leaves room: the pages need not grow
    r.settings.min_samples = r.settings.max_samples = 1;
    r.settings.workers = r.settings.threads = 1;
    r.settings.unwrap_cache = "off";
    r.settings.contact_cuts = cuts;
    if (!keep.empty()) r.settings.keep_layout = dir_.path() / keep / "charts.json";
    const auto report = run_bake(r, [](const BakeProgress&) {});
    EXPECT_TRUE(report) << (report ? "" : report.error().message);
    return report ? *report : BakeReport{};
  }
  json read(const std::string& file) {
    const Bytes b = *read_file(dir_.path() / file);
    return json::parse(reinterpret_cast<const char*>(b.data()),
                       reinterpret_cast<const char*>(b.data()) + b.size());
  }
  // Rows of `field` for the charts of the first bake.
  static json head(const json& charts, const char* field, size_t count) {
    return json(
        std::vector<json>(charts[field].begin(), charts[field].begin() + static_cast<ptrdiff_t>(count)));
  }

  test::TempDir dir_;
};

TEST_F(KeepLayout, AnObjectMoreMovesNothing) {
  const Scene room = test::small_room();
  Scene more = room;
  more.instances.push_back(room.instances[7]);
  more.instances.back().name = "guest";
  more.instances.back().to_world =
      Mat4x3(Vec3(1, 0, 0), Vec3(0, 1.6f, 0), Vec3(0, 0, 1.6f), Vec3(0.3f, 0.3f, 0.3f));
  const BakeReport first = bake(room, "first");
  const BakeReport kept = bake(more, "kept", "first");
  const BakeReport anew = bake(more, "anew");
  const json a = read("first/charts.json"), b = read("kept/charts.json"), c = read("anew/charts.json");
  const size_t charts = a["transforms"].size();
  ASSERT_GT(b["transforms"].size(), charts);
  EXPECT_EQ(b["width"], a["width"]);
  EXPECT_EQ(b["height"], a["height"]);
  EXPECT_EQ(head(b, "transforms", charts), a["transforms"]);
  EXPECT_EQ(head(b, "layout", charts), a["layout"]);
  EXPECT_NE(head(c, "transforms", charts), a["transforms"]) << "the scene does not test anything";
  EXPECT_EQ(kept.atlas.kept_charts, charts);
  EXPECT_EQ(anew.atlas.kept_charts, 0u);

  const json report = read("kept/report.json"), plain = read("anew/report.json");
  EXPECT_EQ(report["atlas"]["kept_charts"], charts);
  const Bytes file = *read_file(dir_.path() / "first/charts.json");
  EXPECT_EQ(report["atlas"]["kept_layout_sha256"], sha256(file).hex());
  EXPECT_FALSE(plain["atlas"].contains("kept_layout_sha256"));
  EXPECT_EQ(plain["atlas"]["kept_charts"], 0);
}

TEST_F(KeepLayout, TheSameSceneIsLaidOutTheSame) {
  const Scene room = test::small_room();
  bake(room, "first");
  bake(room, "again", "first");
  EXPECT_EQ(*read_file(dir_.path() / "first/charts.bin"), *read_file(dir_.path() / "again/charts.bin"));
  EXPECT_EQ(*read_file(dir_.path() / "first/charts.json"), *read_file(dir_.path() / "again/charts.json"));
}

TEST_F(KeepLayout, LayoutAtlasSaysThatItIsNotUsed) {
  const Scene room = test::small_room();
  bake(room, "first", "", false);  // faces that a cut hides have no texels: no atlas of all faces
  BakeSettings settings;
  settings.layout = "pack";
  settings.keep_layout = dir_.path() / "first/charts.json";
  std::vector<StageTime> times;
  const auto packed = run_preflight(dir_.path() / "first/scene.glb", settings, times, [](const auto&) {});
  ASSERT_TRUE(packed) << packed.error().message;
  EXPECT_TRUE(packed->atlas.packed);
  settings.layout = "atlas";
  settings.instanced = true;
  const json charts = read("first/charts.json");
  settings.width = charts["width"];
  settings.height = charts["height"];
  const auto own = run_preflight(dir_.path() / "first/scene.glb", settings, times, [](const auto&) {});
  ASSERT_TRUE(own) << own.error().message;
  std::string all;
  for (const std::string& s : own->atlas.warnings) all += s + "\n";
  EXPECT_SAYS(all, "--keep-layout has no effect");
  EXPECT_SAYS(all, "--instanced has no effect");
}

}  // namespace
}  // namespace kiln
