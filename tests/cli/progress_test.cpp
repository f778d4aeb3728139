// What a user reads while a bake runs and when it ends.
#include "coordinator/cli/progress.h"

#include <fstream>
#include <iterator>

#include "coordinator/report/report.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

TEST(WholeShare, NeverFalls) {
  WholeShare share;
  EXPECT_LT(share.update(1, -1), 0) << "nothing is known yet";
  EXPECT_DOUBLE_EQ(share.update(2, 6), 0.25);
  EXPECT_DOUBLE_EQ(share.update(3, 30), 0.25) << "a later prediction of more time left moves nothing back";
  EXPECT_DOUBLE_EQ(share.update(4, -1), 0.25) << "nor does none at all";
  EXPECT_DOUBLE_EQ(share.update(6, 6), 0.5);
  EXPECT_LT(share.update(10, 0), 1) << "the command has not ended";
  WholeShare at_once;
  EXPECT_LT(at_once.update(0, 0), 0);
}

TEST(NextStep, SaysWhatStoppedTheBake) {
  BakeReport report;
  EXPECT_EQ(stopped_by(report), "error");
  EXPECT_EQ(next_step(report), "");
  report.probes.complete = false;
  EXPECT_EQ(stopped_by(report), "time-limit");
  EXPECT_NE(next_step(report).find("--probe-spacing"), std::string::npos) << next_step(report);
  report.probes.complete = true;
  report.held_back = 0.25;
  report.settings.max_samples = 128;
  EXPECT_EQ(stopped_by(report), "max-samples");
  EXPECT_NE(next_step(report).find("--max-samples 128: 25.0 %"), std::string::npos) << next_step(report);
  report.complete = false;
  EXPECT_EQ(stopped_by(report), "time-limit");
  EXPECT_NE(next_step(report).find("--time-limit"), std::string::npos);
  report.statement.never_sampled = 1;
  EXPECT_NE(next_step(report).find("not every texel was sampled"), std::string::npos);
}

// Both ends of a real bake.
TEST(NextStep, OfABake) {
  const test::TempDir dir;
  test::write_scene_glb(test::small_room(), dir.path() / "room.glb");
  const auto bake = [&](const std::string& options) {
    const auto done = test::run_kiln(dir.path(),
                                     "bake room.glb -o out --quiet --texels-per-metre 2 --encode none "
                                     "--preview off --min-samples 16 --max-samples 16 " +
                                         options);
    EXPECT_EQ(done.exit_status, 0) << done.output;
    std::ifstream in(dir.path() / "out/report.json");
    return std::pair(done.output, std::string(std::istreambuf_iterator<char>(in), {}));
  };
  const auto [held, held_json] = bake("--error 0.0001");
  EXPECT_NE(held.find("stopped by --max-samples 16"), std::string::npos) << held;
  EXPECT_NE(held_json.find("\"stopped_by\": \"max-samples\""), std::string::npos);
  const auto [reached, reached_json] = bake("--error 1000%");
  EXPECT_NE(reached.find("the map as a whole is within --error"), std::string::npos) << reached;
  EXPECT_NE(reached_json.find("\"stopped_by\": \"error\""), std::string::npos);
}

}  // namespace
}  // namespace kiln
