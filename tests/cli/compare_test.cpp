#include <fstream>

#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {

std::string compare(const test::TempDir& dir, const std::string& arguments, int status) {
  const auto r = test::run_kiln(dir.path(), "compare " + arguments);
  EXPECT_EQ(r.exit_status, status) << r.output;
  return r.output;
}

void write_map(const std::filesystem::path& path, uint32_t width, const std::vector<float>& y,
               const std::vector<float>& alpha) {
  const ExrChannel channels[] = {{"R", y.data()}, {"G", y.data()}, {"B", y.data()}, {"A", alpha.data()}};
  ASSERT_TRUE(write_exr(path, width, static_cast<uint32_t>(y.size()) / width, channels));
}

TEST(Compare, BiasAndErrorOverTexelsThatBothHold) {
  test::TempDir dir;
  write_map(dir.path() / "a.exr", 2, {1, 3, 5, 100}, {1, 1, 1, 0});
  write_map(dir.path() / "b.exr", 2, {1, 2, 6, 1}, {1, 1, 1, 1});
  const std::string out = compare(dir, "a.exr b.exr --json", 0);
  EXPECT_NE(out.find("\"texels\": 3"), std::string::npos) << out;
  EXPECT_NE(out.find("\"rmse\": 0.816"), std::string::npos) << out;  // sqrt(2/3)
  EXPECT_NE(out.find("\"x\": 1"), std::string::npos) << out;
}

TEST(Compare, DifferentSizesAndMissingFilesAreUsageErrors) {
  test::TempDir dir;
  write_map(dir.path() / "a.exr", 2, {1, 3, 5, 7}, {1, 1, 1, 1});
  write_map(dir.path() / "b.exr", 1, {1, 2}, {1, 1});
  EXPECT_NE(compare(dir, "a.exr b.exr", 2).find("2x2 and 1x2"), std::string::npos);
  EXPECT_NE(compare(dir, "a.exr none.exr", 2).find("none.exr"), std::string::npos);
  compare(dir, "a.exr", 2);
}

TEST(JobFile, BesideTheSceneIsReadAndTheCommandLineOverridesIt) {
  test::TempDir dir;
  std::filesystem::copy_file(test::source_dir() / "tests/scenes/arcade/arcade.gltf",
                             dir.path() / "room.gltf");
  std::ofstream(dir.path() / "room.kiln.json") << R"({"error": -1})";
  const std::string kiln = "cd '" + dir.path().string() + "' && '" +
                           (test::binary_dir() / "bin/kiln").string() + "' plan room.gltf";
  EXPECT_NE(test::run_command(kiln).output.find("room.kiln.json: --error -1"), std::string::npos);
  std::ofstream(dir.path() / "other.json") << R"({"error": -2})";
  EXPECT_NE(test::run_command(kiln + " --config other.json").output.find("other.json: --error -2"),
            std::string::npos);
}

TEST(Help, EveryCommandHasAnExample) {
  for (const char* command : {"bake", "plan", "compare", "bench", "encode"}) {
    const auto r =
        test::run_command("'" + (test::binary_dir() / "bin/kiln").string() + "' " + command + " --help");
    EXPECT_EQ(r.exit_status, 0);
    EXPECT_NE(r.output.find("Example"), std::string::npos) << command;
  }
}

}  // namespace
}  // namespace kiln
