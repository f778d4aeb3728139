// --unseen as a user runs it: what plan and report say, and that what was taken for unseen is black.
#include "common/base/files.h"
#include "tests/bake/scene_gltf.h"
#include "tests/import/gltf_builder.h"
#include "tests/unseen/world.h"

namespace kiln {
namespace {
using nlohmann::json;

class UnseenCommand : public testing::Test {
 protected:
  test::CommandResult kiln(const std::string& arguments) { return test::run_kiln(dir_.path(), arguments); }
  std::string read(const std::string& file) {
    const auto bytes = read_file(dir_.path() / file);
    EXPECT_TRUE(bytes) << file;
    return bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : "null";
  }
  void write(const test::World& world) { test::write_scene_glb(world.scene, dir_.path() / "x.glb"); }

  test::TempDir dir_;
};

const std::string kBake =
    " --layout pack --min-samples 16 --max-samples 16 --cache off --denoise off --preview off --encode none "
    "--unwrap-cache off --quiet";

TEST_F(UnseenCommand, PlanAndReportSayHowManyAndTheyAreBlack) {
  write(test::lit_room());
  const auto planned = kiln("plan x.glb --layout pack --unseen auto --json");
  ASSERT_EQ(planned.exit_status, 0) << planned.output;
  const json plan = json::parse(planned.output),
             keep = json::parse(kiln("plan x.glb --layout pack --json").output);
  EXPECT_EQ(keep["unseen"]["charts"], 0);
  EXPECT_EQ(keep["unseen"]["saved_texels"], 0);
  EXPECT_GE(plan["unseen"]["charts"], 6);
  EXPECT_EQ(plan["charts"], keep["charts"]);
  const uint64_t before = keep["chart_texels"], after = plan["chart_texels"],
                 saved = plan["unseen"]["saved_texels"];
  EXPECT_EQ(before - after, saved);
  EXPECT_NEAR(plan["unseen"]["share"].get<double>(),
              plan["unseen"]["texels"].get<double>() / static_cast<double>(before), 1e-5);
  EXPECT_SAYS(kiln("plan x.glb --layout pack --unseen auto").output,
              "are reached by no camera, light or opening");

  ASSERT_EQ(kiln("bake x.glb -o out --unseen auto" + kBake).exit_status, 0);
  json unseen = json::parse(read("out/report.json"))["atlas"]["unseen"];
  EXPECT_EQ(unseen["charts_that_met_light"], 0);
  unseen.erase("charts_that_met_light");
  EXPECT_EQ(unseen, plan["unseen"]);
}

TEST_F(UnseenCommand, TheBytesAreTheSameForAnyNumberOfWorkersAndThreads) {
  write(test::lit_room());
  std::string first;
  for (const char* force :
       {"--workers 1 --threads 1", "--workers 2 --threads 1", "--workers 1 --threads 3"}) {
    ASSERT_EQ(kiln(std::string("bake x.glb -o out --unseen auto ") + force + kBake).exit_status, 0);
    const std::string bytes = read("out/irradiance.exr") + read("out/charts.json");
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first) << force;
  }
}

TEST_F(UnseenCommand, SaysWhereItIsNotHeeded) {
  test::World world;
  world.add(test::plane(1, 4, test::Uv::kUnit), "floor", Vec3(0.0f));
  write(world);
  EXPECT_SAYS(kiln("plan x.glb --layout atlas --unseen auto").output,
              "--unseen auto has no effect on the file's own atlas");
  EXPECT_SAYS(kiln("plan x.glb --layout pack --unseen auto").output,
              "the scene has neither a camera nor a light");
  EXPECT_SAYS(kiln("plan x.glb --unseen sometimes").output, "'sometimes' is not one of keep, auto");
}

}  // namespace
}  // namespace kiln
