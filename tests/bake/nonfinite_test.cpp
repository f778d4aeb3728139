// Light beyond float, through a whole bake: left out, counted, and its place told to the user.
#include "coordinator/run/nonfinite.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "coordinator/run/bake_run.h"
#include "tests/analytic/scene_maker.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

Scene hot_panel(float radiance) {
  test::SceneMaker m;
  const uint32_t floor = m.lambert(Vec3(0.5f)), hot = m.lambert(Vec3(0.0f), Vec3(radiance));
  m.quad({0, 0, 0}, {0, 0, 2}, {2, 0, 0}, floor);
  m.quad({1, 0.02f, 1}, {0.1f, 0, 0}, {0, 0, 0.1f}, hot);
  m.scene().instances[0].name = "floor";
  return m.take();
}

BakeReport bake(const test::TempDir& dir, float radiance) {
  test::write_scene_glb(hot_panel(radiance), dir.path() / "room.glb");
  BakeRequest r;
  r.scene = dir.path() / "room.glb";
  r.output = dir.path() / "out";
  r.worker_program = test::binary_dir() / "bin/kiln-worker";
  r.settings.layout = "pack";
  r.settings.texels_per_metre = 4;
  r.settings.min_samples = r.settings.max_samples = 64;
  r.settings.workers = r.settings.threads = 1;
  auto report = run_bake(r, [](const BakeProgress&) {});
  if (!report) throw std::runtime_error(report.error().message);
  return *report;
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Nonfinite, TheReportSaysHowManyAndWhere) {
  const test::TempDir dir;
  const BakeReport report = bake(dir, 3e38f);
  ASSERT_GT(report.farm.nonfinite, 0u);
  ASSERT_FALSE(report.nonfinite.empty());
  const auto json = nlohmann::json::parse(text_of(dir.path() / "out/report.json"));
  EXPECT_EQ(json["farm"]["nonfinite_contributions"], report.farm.nonfinite);
  const auto& places = json["nonfinite"];
  ASSERT_EQ(places.size(), report.nonfinite.size());
  EXPECT_EQ(places[0]["instance"], "floor");
  EXPECT_EQ(places[0]["x"], report.nonfinite[0].x);
  EXPECT_EQ(places[0]["y"], report.nonfinite[0].y);
  EXPECT_EQ(places[0]["page"], 0);
  EXPECT_EQ(places[0]["site"], report.nonfinite[0].site);
  EXPECT_EQ(places[0]["sample"], report.nonfinite[0].sample);
  const std::string page = text_of(dir.path() / "out/report.html");
  EXPECT_NE(page.find("exceed the range of a float"), std::string::npos);
}

TEST(Nonfinite, NothingIsSaidOfOrdinaryLight) {
  const test::TempDir dir;
  const BakeReport report = bake(dir, 3);
  EXPECT_EQ(report.farm.nonfinite, 0u);
  EXPECT_TRUE(report.nonfinite.empty());
  EXPECT_EQ(text_of(dir.path() / "out/report.html").find("exceed the range"), std::string::npos);
}

// Results come in any order, and from workers that may say anything.
TEST(Nonfinite, PlacesAreSortedAndForeignOnesIgnored) {
  Scene scene = hot_panel(1);
  Atlas atlas;
  atlas.width = 4, atlas.height = 2, atlas.pages = 2;
  for (uint32_t site = 0; site < 3; ++site) {
    atlas.sites.texel.push_back(5 * site + 1);  // 1, 6, 11
    atlas.sites.first_word.push_back(6 * site);
    for (uint32_t word : {1u, 0u, 1u, 0u, site % 2, 0u}) atlas.sites.words.push_back(word);
  }
  NonfiniteLog log(atlas, scene);
  EXPECT_EQ(log.sentence(), "");
  const auto add = [&](uint32_t texel, uint32_t sample) {
    UnitResult r;
    r.nonfinite = 2;
    r.nonfinite_texel = texel, r.nonfinite_sample = sample;
    log.add({0, 0, 64, {0, 1, 2}}, r);
  };
  add(4'000'000'000u, 1);
  EXPECT_TRUE(log.places().empty());
  add(11, 3), add(1, 9), add(1, 2), add(6, 0);
  ASSERT_EQ(log.places().size(), 4u);
  EXPECT_EQ(log.places()[0].sample, 2u);
  EXPECT_EQ(log.places()[2].x, 2u);
  EXPECT_EQ(log.places()[2].instance, scene.instances[1].name);
  EXPECT_EQ(log.places()[3].page, 1u);
  EXPECT_EQ(log.sentence(),
            "10 samples exceed the range of a float and were dropped: the first at texel (1, 0) of "
            "page 0, 'floor', sample 2");
}

}  // namespace
}  // namespace kiln
