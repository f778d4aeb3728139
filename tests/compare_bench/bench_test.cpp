#include "coordinator/measure/bench/bench.h"

#include <fstream>
#include <sstream>

#include "coordinator/measure/bench/results.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

TEST(Configurations, AreParsed) {
  const auto parsed = parse_configuration("noon:sun=0,1,0:5,5,5,ladder=samples,cache=off");
  ASSERT_TRUE(parsed) << parsed.error().message;
  const Configuration& c = *parsed;
  EXPECT_EQ(c.name, "noon");
  EXPECT_TRUE(c.by_samples);
  ASSERT_EQ(c.settings.size(), 2u);
  EXPECT_EQ(c.settings[0].second, "0,1,0:5,5,5");
  EXPECT_EQ(c.settings[1].second, "off");
  EXPECT_TRUE(parse_configuration("plain")->settings.empty());
  EXPECT_EQ(default_configurations().size(), 4u);
  for (const char* wrong :
       {"", ":cache=off", "a b:cache=off", "a:cache", "a:cache=maybe", "a:colour=red", "a:ladder=up"}) {
    const auto r = parse_configuration(wrong);
    ASSERT_FALSE(r) << wrong;
    EXPECT_NE(r.error().message.find("NAME:key=value"), std::string::npos);
  }
}

TEST(Configurations, BudgetsBecomeSettings) {
  BakeSettings base;
  base.seed = 10;
  const auto fixed = *settings_of_run(base, default_configurations()[0], 256, 2);
  EXPECT_EQ(fixed.min_samples, 256u);
  EXPECT_EQ(fixed.max_samples, 256u);
  EXPECT_EQ(fixed.sampler, "halton");
  EXPECT_EQ(fixed.seed, 12u);
  EXPECT_TRUE(fixed.encodings.empty());
  EXPECT_FALSE(fixed.seams);
  ASSERT_TRUE(set_option(base, "seams", "on", "command line"));
  const auto adaptive = *settings_of_run(base, default_configurations()[3], 0.2, 0);
  EXPECT_EQ(adaptive.error, 0.2);
  EXPECT_TRUE(adaptive.cache && adaptive.denoise && adaptive.seams);
  EXPECT_FALSE(settings_of_run(base, default_configurations()[0], 0.5, 0));  // half a sample
  EXPECT_FALSE(parse_budgets("errors", "0.4,,0.1"));
  EXPECT_FALSE(parse_budgets("errors", "-1"));
}

TEST(Curves, CrossingsLieOnThePowerLaw) {
  // error = 0.1 / seconds: 1e-3 at 100 s, whatever the points.
  const std::vector<double> seconds{1, 7, 40, 900}, error{0.1, 0.1 / 7, 0.1 / 40, 0.1 / 900};
  const Crossing c = find_crossing(seconds, error, 1e-3);
  EXPECT_EQ(c.kind, Crossing::Kind::kReached);
  EXPECT_NEAR(c.cost, 100, 1e-9);
  EXPECT_EQ(crossing_text(c), "100");
  EXPECT_EQ(crossing_text(find_crossing(seconds, error, 1e-5)), "> 900");
  EXPECT_EQ(crossing_text(find_crossing(seconds, error, 0.2)), "< 1");
  EXPECT_EQ(crossing_text(find_crossing({}, {}, 1e-3)), "");
  // Below nothing: reached, between the points.
  const Crossing none = find_crossing({1, 10}, {0.1, -1e-9}, 0.01);
  EXPECT_EQ(none.kind, Crossing::Kind::kReached);
  EXPECT_NEAR(none.cost, std::sqrt(10.0), 1e-9);  // 0.1, 0.01, 0.001
}

TEST(Curves, PointsAreMediansOfRepeats) {
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 2, 3}), 2.5);
  std::vector<BenchRun> runs;
  for (uint32_t repeat = 0; repeat < 3; ++repeat)
    for (const double budget : {64.0, 256.0}) {
      BenchRun r;
      r.configuration = "brute";
      r.budget_value = budget;
      r.repeat = repeat;
      r.seconds = budget / 64 * (repeat == 0 ? 9 : repeat);  // 9, 1, 2
      r.comparison.rel_mse = 0.002 * 64 / budget;
      runs.push_back(r);
    }
  const auto curves = curves_of(runs);
  ASSERT_EQ(curves.size(), 1u);
  ASSERT_EQ(curves[0].points.size(), 2u);
  EXPECT_EQ(curves[0].points[0].seconds, 2);
  EXPECT_EQ(curves[0].points[1].seconds, 8);
  EXPECT_NEAR(curves[0].seconds[0].cost, 4, 1e-9);  // 1e-3 is half way
}

TEST(Measure, TimeOfTheMapLeavesFilesAndImportOut) {
  EXPECT_DOUBLE_EQ(map_seconds({{"import", 5},
                                {"atlas", 1},
                                {"neighbours", 0.125},
                                {"bake", 2},
                                {"fill", 0.5},
                                {"seams", 0.25},
                                {"textures", 7},
                                {"encode", 1},
                                {"preview", 3}}),
                   2.875);
}

TEST(Bench, FromTheCommandLine) {
  test::TempDir dir;
  test::write_scene_glb(test::small_room(), dir.path() / "room.glb");
  const std::string kiln = "cd '" + dir.path().string() + "' && '" +
                           (test::binary_dir() / "bin/kiln").string() +
                           "' bench room.glb -o out --references refs --layout pack --texels-per-metre 1 "
                           "--threads 1 --unwrap-cache off --reference-samples 64 ";
  const auto r =
      test::run_command(kiln +
                        "--set plain:ladder=samples,cache=off --set asked:cache=off,min-samples=8 --samples "
                        "4,16 --errors 0.5 --repeats 2");
  ASSERT_EQ(r.exit_status, 0) << r.output;
  EXPECT_NE(r.output.find("| asked |"), std::string::npos) << r.output;
  const auto read = [&](const char* name) {
    std::ifstream in(dir.path() / "out" / name);
    std::stringstream all;
    all << in.rdbuf();
    return all.str();
  };
  const std::string csv = read("bench.csv"), json = read("bench.json");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 2 * 3) << csv;
  const size_t line = csv.find('\n') + 1;  // every run has a value for every name
  EXPECT_EQ(std::count(csv.begin(), csv.end(), ','),
            (1 + 2 * 3) * std::count(csv.begin(), csv.begin() + static_cast<ptrdiff_t>(line), ','));
  EXPECT_NE(r.output.find(", stated "), std::string::npos) << r.output;
  EXPECT_NE(json.find("\"stated_rel_mse\""), std::string::npos);
  EXPECT_NE(json.find("\"kiln bench\""), std::string::npos);
  EXPECT_NE(read("bench.svg").find("</svg>"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(dir.path() / "out/bench.png"));
  EXPECT_FALSE(std::filesystem::exists(dir.path() / "out/run"));
  const auto again = test::run_command(kiln + "--only-reference");
  EXPECT_NE(again.output.find("kept from before"), std::string::npos) << again.output;
  for (const char* wrong : {"--set a:b=c", "--set a:cache=off --set a:cache=on", "--errors no", "--repeats 0",
                            "--reference-samples -4"}) {
    EXPECT_EQ(test::run_command(kiln + wrong).exit_status, 2) << wrong;
  }
}

}  // namespace
}  // namespace kiln
