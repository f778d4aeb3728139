// OpenImageIO is loaded by the commands that see an image, from beside the program or from where it is
// installed.
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

TEST(ImageLibrary, IsLoadedWithTheFirstImage) {
  const test::TempDir dir;
  const fs::path programs = test::binary_dir() / "bin",
                 textured = test::source_dir() / "tests/scenes/room/room.gltf";
  test::write_scene_glb(test::small_room(), dir.path() / "plain.glb");
  fs::create_directories(dir.path() / "bin");
  fs::copy_file(programs / "kiln", dir.path() / "bin/kiln");
  const auto plan = [&](const fs::path& scene) {
    return test::run_command((dir.path() / "bin/kiln").string() + " plan '" + scene.string() + "'");
  };
  const auto plain = plan(dir.path() / "plain.glb");
  EXPECT_EQ(plain.exit_status, 0) << plain.output;
  const auto without = plan(textured);
  EXPECT_NE(without.exit_status, 0);
  for (const char* place : {"bin/kiln-images.so", "lib/kiln/kiln-images.so"})
    EXPECT_NE(without.output.find((dir.path() / place).string()), std::string::npos) << without.output;

  fs::create_directories(dir.path() / "lib/kiln");
  fs::copy_file(programs / "kiln-images.so", dir.path() / "lib/kiln/kiln-images.so");
  const auto installed = plan(textured);
  EXPECT_EQ(installed.exit_status, 0) << installed.output;
  fs::rename(dir.path() / "lib/kiln/kiln-images.so", dir.path() / "bin/kiln-images.so");
  const auto beside = plan(textured);
  EXPECT_EQ(beside.exit_status, 0) << beside.output;
}

}  // namespace
}  // namespace kiln
