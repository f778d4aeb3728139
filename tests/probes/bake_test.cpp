// Bakes with probes end to end: files, equal bytes, and what is refused.
#include <signal.h>

#include <atomic>
#include <fstream>
#include <map>

#include "common/base/files.h"
#include "common/base/json.h"
#include "coordinator/run/bake_run.h"
#include "coordinator/run/encode_run.h"
#include "coordinator/run/probe_run.h"
#include "coordinator/scene/imageio/exr.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/analytic/scene_maker.h"
#include "tests/bake/scene_gltf.h"
#include "tests/bake/worker_processes.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

class ProbeBake : public testing::Test {
 protected:
  ProbeBake() { test::write_scene_glb(test::small_room(), dir_.path() / "room.glb"); }

  BakeRequest request(const std::string& quantities) {
    BakeRequest r;
    r.scene = dir_.path() / "room.glb";
    r.output = dir_.path() / ("out" + std::to_string(++count_));
    r.worker_program = test::binary_dir() / "bin/kiln-worker";
    const auto set = [&](const char* name, const char* value) {
      EXPECT_TRUE(set_option(r.settings, name, value, "test"));
    };
    set("quantities", quantities.c_str());
    set("probes", "auto");
    set("probe-spacing", "0.5");
    set("probe-max-spacing", "1");
    set("probe-visibility", "on");
    set("min-samples", "64");
    set("max-samples", "3000");
    set("texels-per-metre", "2");
    set("encode", "none");
    set("tile-texels", "8");
    set("workers", "1");
    set("threads", "1");
    r.pictures = false;
    return r;
  }

  std::map<std::string, std::string> bake(
      const BakeRequest& r, BakeReport* out = nullptr,
      const std::function<void(const BakeProgress&)>& progress = [](const auto&) {}) {
    const auto report = run_bake(r, progress);
    EXPECT_TRUE(report) << (report ? "" : report.error().message);
    std::map<std::string, std::string> digests;
    if (!report) return digests;
    if (out) *out = *report;
    for (const OutputFile& f : report->outputs)
      if (f.name.starts_with("probes")) digests[f.name] = f.digest.hex();
    return digests;
  }

  test::CommandResult kiln(const std::string& arguments) { return test::run_kiln(dir_.path(), arguments); }

  test::TempDir dir_;
  int count_ = 0;
};

TEST_F(ProbeBake, AloneItWritesProbesAndNoMap) {
  const BakeRequest r = request("probes");
  EXPECT_EQ(bake(r).size(), 4u);
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(r.output)) names.insert(entry.path().filename().string());
  EXPECT_EQ(names, (std::set<std::string>{"probes.json", "probes.exr", "probes_irradiance.exr",
                                          "probes_distance.exr", "report.json", "scene.glb"}));
  const auto master = read_exr(r.output / "probes.exr");
  ASSERT_TRUE(master);
  const auto document = parse_json([&] {
    const auto bytes = read_file(r.output / "probes.json");
    return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  }());
  ASSERT_TRUE(document);
  const double probes = document->find("probes")->number;
  EXPECT_GT(probes, 60);
  size_t lit = 0, sampled = 0;
  for (size_t i = 0; i < static_cast<size_t>(probes); ++i) {
    const bool inactive = master->plane("state")[i] == 2;
    EXPECT_EQ(inactive, master->plane("samples")[i] == 0) << i;
    sampled += !inactive;
    lit += !inactive && master->plane("L00.G")[i] > 0 && master->plane("error.L00")[i] > 0;
  }
  EXPECT_GT(sampled, 30u);
  EXPECT_GT(2 * lit, sampled);  // those outside of the room's walls see no lamp
}

TEST_F(ProbeBake, BesideAMapItIsTheSame) {
  const auto alone = bake(request("probes"));
  const BakeRequest both = request("light,probes");
  EXPECT_EQ(bake(both), alone);
  EXPECT_TRUE(fs::exists(both.output / "irradiance.exr"));
}

TEST_F(ProbeBake, TheSameBytesForAnyNumberOfWorkersAndTiles) {
  const auto reference = bake(request("probes"));
  for (const char* workers : {"2", "5"}) {
    BakeRequest r = request("probes");
    ASSERT_TRUE(set_option(r.settings, "workers", workers, "test"));
    EXPECT_EQ(bake(r), reference) << workers;
  }
  for (const char* tile : {"1", "5000"}) {
    BakeRequest r = request("probes");
    ASSERT_TRUE(set_option(r.settings, "tile-texels", tile, "test"));
    ASSERT_TRUE(set_option(r.settings, "threads", "3", "test"));
    EXPECT_EQ(bake(r), reference) << tile;
  }
  BakeRequest r = request("probes");
  r.settings.seed = 1;
  EXPECT_NE(bake(r), reference);
}

TEST_F(ProbeBake, TheSameBytesWhereAWorkerIsKilled) {
  const auto reference = bake(request("probes"));
  for (const char* workers : {"1", "2"}) {
    BakeRequest r = request("probes");
    ASSERT_TRUE(set_option(r.settings, "workers", workers, "test"));
    std::atomic<pid_t> victim = 0;
    BakeReport report;
    const auto killed = bake(r, &report, [&](const BakeProgress& p) {
      if (victim != 0 || p.stage != "probes" || !(p.done > 0)) return;
      const auto processes = test::worker_processes();
      if (processes.empty()) return;
      victim = *processes.begin();
      ::kill(victim, SIGKILL);
    });
    EXPECT_EQ(killed, reference) << workers;
    EXPECT_NE(victim, 0);
    EXPECT_GE(report.farm.workers_lost, 1u);
  }
}

// scene.glb names the probes, and still does when textures are made again beside it.
TEST_F(ProbeBake, TheSceneNamesItsProbes) {
  const BakeRequest r = request("light,probes");
  EXPECT_EQ(bake(r).size(), 4u);
  const auto names_them = [](const fs::path& folder) {
    const auto bytes = read_file(folder / "scene.glb");
    const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    return text.find("\"KILN_probes\":{\"distance\":{\"uri\":\"probes_distance.exr\"}") != text.npos &&
           text.find("\"name\":\"probes auto\"") != text.npos;
  };
  EXPECT_TRUE(names_them(r.output));
  const BakeRequest alone = request("probes");
  EXPECT_EQ(bake(alone).size(), 4u);
  EXPECT_TRUE(names_them(alone.output));
  for (const bool beside : {true, false}) {
    EncodeRequest again{r.scene, r.output, beside ? r.output : dir_.path() / "elsewhere", {}};
    ASSERT_TRUE(set_option(again.settings, "encode", "half", "test"));
    const auto encoded = run_encode(again, [](const auto&) {});
    ASSERT_TRUE(encoded) << encoded.error().message;
    EXPECT_EQ(names_them(again.output), beside);
  }
}

// plan -o without a map: a page and a picture of probes, in which the colours of the states that there are
// stand for probes, and for their names below.
TEST_F(ProbeBake, APlanDrawsWhereTheyAre) {
  const auto result = kiln("plan room.glb -o plan --quantities probes --probes auto --probe-spacing 0.5");
  ASSERT_EQ(result.exit_status, 0) << result.output;
  EXPECT_NE(result.output.find("plan/probes.png"), std::string::npos) << result.output;
  EXPECT_FALSE(fs::exists(dir_.path() / "plan/density.png"));
  const auto page = read_file(dir_.path() / "plan/plan.html");
  ASSERT_TRUE(page);
  const std::string_view html(reinterpret_cast<const char*>(page->data()), page->size());
  EXPECT_NE(html.find("data:image/png"), html.npos);
  EXPECT_NE(html.find("in 1 volume"), html.npos);
  EXPECT_EQ(html.find("charts"), html.npos);
  const auto bytes = read_file(dir_.path() / "plan/probes.png");
  ASSERT_TRUE(bytes);
  const auto picture = decode_image(*bytes, "probes.png");
  ASSERT_TRUE(picture);
  size_t white = 0, magenta = 0;
  constexpr size_t kLegend = 64;  // rows
  for (size_t i = 0; i < size_t{picture->width} * (picture->height - kLegend); ++i) {
    const auto* const p = reinterpret_cast<const uint8_t*>(&picture->texels[i * picture->channels]);
    white += p[0] > 220 && p[1] > 220 && p[2] > 220;
    magenta += p[0] > 220 && p[1] < 40 && p[2] > 220;
  }
  EXPECT_GT(white, 300u);
  EXPECT_GT(magenta, 100u);
  EXPECT_EQ(kiln("plan room.glb -o none --quantities probes --probes off").exit_status, 2);
}

// A volume within a block of 4 m, out of which no probe can move.
TEST_F(ProbeBake, AVolumeInsideGeometryIsNamed) {
  test::SceneMaker m;
  m.lambert(Vec3(0.5f));
  m.box({0, 0, 0}, {4, 4, 4}, false);
  test::write_scene_glb(m.take(), dir_.path() / "block.glb");
  std::ofstream(dir_.path() / "v.json")
      << R"({"version":1,"volumes":[{"name":"core","min":[1.4,1.4,1.4],"max":[2.6,2.6,2.6],"spacing":0.4}]})";
  const auto result = kiln("bake block.glb -o bad --quiet --quantities probes --probes v.json");
  EXPECT_EQ(result.exit_status, 2) << result.output;
  EXPECT_NE(result.output.find("'core': all of its 64 probes are inside geometry"), std::string::npos)
      << result.output;
  EXPECT_FALSE(fs::exists(dir_.path() / "bad/probes.json"));
}

TEST_F(ProbeBake, MoreProbesThanMemoryAreRefused) {
  const BakeRequest r = request("probes");
  const auto imported = import_scene(r.scene, {});
  ASSERT_TRUE(imported);
  const auto planned = plan_probes(*imported, r.settings);
  ASSERT_TRUE(planned && *planned);
  const uint64_t needed = (*planned)->size() * probe_bytes(true);
  EXPECT_TRUE(plan_probes(*imported, r.settings, needed));
  const auto refused = plan_probes(*imported, r.settings, needed - 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kInvalidInput);
  EXPECT_NE(refused.error().message.find(std::to_string((*planned)->size()) + " probes need about"),
            std::string::npos)
      << refused.error().message;
  // 910 x 910 tiles of distances are as many as a texture of 16384 x 16384 holds.
  BakeSettings many = r.settings;
  ASSERT_TRUE(set_option(many, "probe-files", "bevy,textures", "test"));
  many.max_probes = 10'000'000;
  many.probe_spacing = many.probe_max_spacing = 0.02;
  const auto tall = plan_probes(*imported, many, uint64_t{1} << 40);
  ASSERT_FALSE(tall);
  EXPECT_NE(tall.error().message.find("more than the 828100 whose textures"), std::string::npos)
      << tall.error().message;
}

// A message, and status 2.
TEST_F(ProbeBake, BadInputIsNamed) {
  const auto file = [&](const std::string& volume, int version = 1) {
    std::ofstream(dir_.path() / "v.json")
        << "{\"version\": " << version << ", \"volumes\": [" << volume << "]}";
  };
  const auto expect = [&](const std::string& options, const std::string& words) {
    const auto result = kiln("bake room.glb -o bad --quiet --quantities probes " + options);
    EXPECT_EQ(result.exit_status, 2) << options << ": " << result.output;
    EXPECT_NE(result.output.find(words), std::string::npos) << result.output;
    EXPECT_FALSE(fs::exists(dir_.path() / "bad/probes.json"));
  };
  file(R"({"min":[0,0,0],"max":[1,0,1],"spacing":1})");
  expect("--probes v.json", "has no volume: along y");
  file(R"({"min":[0,0,0],"max":[1,1,1],"spacing":0})");
  expect("--probes v.json", "spacing is 0");
  file(R"({"min":[0,0,0],"max":[1,1,1]})");
  expect("--probes v.json", "it has no spacing");
  file(R"({"min":[0,0,0],"max":[1,1,1],"spacing":1,"max_spacing":0.5})");
  expect("--probes v.json", "largest spacing");
  file(R"({"min":[0,0,0],"max":[1,1,1],"spacing":1,"size":3})");
  expect("--probes v.json", "\"size\"");
  file(R"({"min":[0,0,0],"max":[1,1,1],"spacing":1})", 2);
  expect("--probes v.json", "its version is not 1");
  file(R"({"min":[500,0,0],"max":[501,1,1],"spacing":1})");
  expect("--probes v.json", "is off the scene");
  file(R"({"min":[-1,-1,-1],"max":[1,1,1],"spacing":0.001})");
  expect("--probes v.json", "more than 100000 probes");
  file(R"({"min":[0,"a",0],"max":[1,1,1],"spacing":1})");
  expect("--probes v.json", "min and max");
  std::ofstream(dir_.path() / "v.json") << "{";
  expect("--probes v.json", "v.json");
  expect("--probes nothing.json", "nothing.json");
  expect("--probes off", "leave one of them out");
  expect("--probes auto --probe-spacing 2 --probe-max-spacing 1", "is below --probe-spacing");
}

// A node's volume: its box in the node's space, its spacings in the world's.
TEST_F(ProbeBake, NodesOfTheSceneAskForVolumes) {
  const std::vector<float> positions = {0, 0, 0, 0, 0, 4, 4, 0, 4, 4, 0, 0};
  const std::vector<uint16_t> indices = {0, 1, 2, 0, 2, 3};
  Bytes buffer;
  for (const auto part : {bytes_of(positions), bytes_of(indices)})
    buffer.insert(buffer.end(), part.begin(), part.end());
  ASSERT_TRUE(write_file_atomic(dir_.path() / "x.bin", buffer));
  const auto write = [&](const std::string& probes) {
    std::ofstream(dir_.path() / "x.gltf")
        << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0},)"
        << R"({"name":"hall","translation":[1,0,1],"scale":[2,2,2],"extras":{"kiln":{"probes":)" << probes
        << R"(}}}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
        << R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
        << R"({"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}],)"
        << R"("bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],)"
        << R"("buffers":[{"uri":"x.bin","byteLength":60}]})";
  };
  write(R"({"min":[0,0.1,0],"max":[1.5,1.6,1.5],"spacing":0.5,"visibility":true})");
  const auto plan = kiln("plan x.gltf --json --environment 1,1,1");
  ASSERT_EQ(plan.exit_status, 0) << plan.output;
  // 3 m a side at 0.5 m: two bricks, seven probes.
  EXPECT_NE(plan.output.find("\"probes\": 343"), std::string::npos) << plan.output;
  EXPECT_NE(plan.output.find("\"visibility\": true"), std::string::npos);
  const auto none = kiln("plan x.gltf --json --environment 1,1,1 --probes off");
  EXPECT_EQ(none.output.find("\"probes\": 343"), std::string::npos);
  const auto expect = [&](const std::string& probes, const std::string& words) {
    write(probes);
    const auto result = kiln("plan x.gltf");
    EXPECT_EQ(result.exit_status, 2) << probes;
    EXPECT_NE(result.output.find(words), std::string::npos) << result.output;
    EXPECT_NE(result.output.find("hall"), std::string::npos) << result.output;
  };
  expect("7", "is no object");
  expect(R"({"min":[0,0,0]})", "\"max\"");
  expect(R"({"min":[0,0,0],"max":[1,0,1]})", "has no volume: along y");
  expect(R"({"min":[0,0,0],"max":[1,1,1],"spacing":0})", "spacing is 0");
  expect(R"({"min":[0,0,0],"max":[1,1,1],"visibility":1})", "visibility");
  expect(R"({"min":[0,0,0],"max":[1,1,1],"size":1})", "\"size\"");
}

TEST_F(ProbeBake, ATimeLimitEndsIt) {
  const auto result = kiln(
      "bake room.glb -o out --quiet --quantities probes --probe-spacing 0.5 --error 0.001% "
      "--max-samples 1000000000 --time-limit 4");
  EXPECT_EQ(result.exit_status, 0) << result.output;
  EXPECT_TRUE(fs::exists(dir_.path() / "out/probes.exr"));
  const auto report = read_file(dir_.path() / "out/report.json");
  ASSERT_TRUE(report);
  const std::string_view words(reinterpret_cast<const char*>(report->data()), report->size());
  EXPECT_NE(words.find("\"complete\": false"), words.npos);
}

}  // namespace
}  // namespace kiln
