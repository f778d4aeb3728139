// The demo scene: its script still writes what is checked in, and what is checked in holds what it promises.
#include <algorithm>
#include <set>

#include "common/base/files.h"
#include "coordinator/scene/import/import.h"
#include "tests/support/paths.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

fs::path folder() {
  return test::source_dir() / "tests/scenes/arcade";
}

TEST(Arcade, ScriptWritesTheFilesCheckedIn) {
  if (test::run_command("python3 -c 'import zlib'").exit_status != 0)
    GTEST_SKIP() << "python3 is not installed";
  const test::TempDir out;
  const auto run =
      test::run_command("PYTHONDONTWRITEBYTECODE=1 python3 '" + (folder() / "make_arcade.py").string() +
                        "' '" + out.path().string() + "'");
  ASSERT_EQ(run.exit_status, 0) << run.output;
  std::set<std::string> written;
  for (const auto& entry : fs::directory_iterator(out.path())) {
    const std::string name = entry.path().filename();
    written.insert(name);
    const auto made = read_file(entry.path()), kept = read_file(folder() / name);
    ASSERT_TRUE(made);
    ASSERT_TRUE(kept) << name << " is not checked in";
    EXPECT_TRUE(*made == *kept) << name << " differs from the file checked in: run make_arcade.py";
  }
  for (const auto& entry : fs::directory_iterator(folder()))
    if (entry.is_regular_file() && entry.path().extension() != ".py")
      EXPECT_TRUE(written.count(entry.path().filename()))
          << entry.path() << " is not written by make_arcade.py";
}

class ArcadeScene : public testing::Test {
 protected:
  static const ImportResult& imported() {
    static const Expected<ImportResult> result = import_scene(folder() / "arcade.gltf", BakeSettings());
    EXPECT_TRUE(result) << (result ? "" : result.error().message);
    return *result;
  }
  static long lights(const std::string& type) {
    const auto& all = imported().scene.lights;
    return std::count_if(all.begin(), all.end(), [&](const Record& l) { return l.type == type; });
  }
  template <class Test>
  static bool any_material(const Test& test) {
    const auto& all = imported().scene.materials;
    return std::any_of(all.begin(), all.end(), test);
  }
};

TEST_F(ArcadeScene, IsOfTheSizePromised) {
  EXPECT_GE(imported().scene.triangle_count(), 30000u);
  EXPECT_LE(imported().scene.triangle_count(), 100000u);
  EXPECT_FALSE(imported().cameras.empty());
  for (const ImportNote& note : imported().notes)
    EXPECT_NE(note.kind, ImportNote::Kind::kWarning) << note.what;
}

TEST_F(ArcadeScene, HasEveryKindOfLight) {
  EXPECT_EQ(lights("directional"), 1);
  EXPECT_GE(lights("point"), 4);
  EXPECT_GE(lights("spot"), 1);
  ASSERT_EQ(lights("environment"), 1);
  const Record* image = nullptr;
  for (const Record& l : imported().scene.lights)
    if (l.type == "environment") image = &l;
  ASSERT_TRUE(image->find("image"));
  const Texture& sky = imported().scene.textures[static_cast<size_t>(image->find("image")->texture.texture)];
  EXPECT_EQ(sky.width, 2 * sky.height);
}

TEST_F(ArcadeScene, HasEveryKindOfMaterial) {
  const auto number = [](const Record& m, const char* name) { return m.find(name)->numbers[0]; };
  EXPECT_TRUE(
      any_material([&](const Record& m) { return number(m, "emission") > 1 && m.find("emission_texture"); }));
  EXPECT_TRUE(any_material([](const Record& m) { return m.find("alpha_mode")->word == "mask"; }));
  EXPECT_TRUE(any_material([](const Record& m) { return m.find("alpha_mode")->word == "blend"; }));
  EXPECT_TRUE(any_material([&](const Record& m) { return number(m, "metallic") == 1; }));
  EXPECT_TRUE(any_material([&](const Record& m) { return number(m, "double_sided") == 1; }));
}

TEST_F(ArcadeScene, HasMeshesWithAndWithoutLightmapCoordinatesAndManyInstances) {
  const Scene& scene = imported().scene;
  const auto authored =
      std::count_if(scene.meshes.begin(), scene.meshes.end(), [](const Mesh& m) { return !m.uv[1].empty(); });
  EXPECT_GT(2 * static_cast<size_t>(authored), scene.meshes.size());
  EXPECT_LT(static_cast<size_t>(authored), scene.meshes.size());
  std::vector<int> uses(scene.meshes.size(), 0);
  bool mirrored = false;
  for (const Instance& i : scene.instances) {
    ++uses[i.mesh];
    mirrored |= glm::determinant(glm::mat3(i.to_world)) < 0;
  }
  EXPECT_GE(std::count_if(uses.begin(), uses.end(), [](int n) { return n >= 10; }), 5);
  EXPECT_TRUE(mirrored);
}

}  // namespace
}  // namespace kiln
