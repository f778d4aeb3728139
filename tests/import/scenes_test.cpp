// Real scenes, where they are at hand.
#include <chrono>

#include "common/scene/prepared.h"
#include "coordinator/scene/import/import.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {

class RealScene : public testing::TestWithParam<const char*> {};

TEST_P(RealScene, ImportsWithUnitNormalsAndRoundTrips) {
  const auto path = test::shared_scene(GetParam());
  if (!path) GTEST_SKIP() << GetParam() << " is not on this machine (KILN_SCENES names the folder)";
  const auto result = import_scene(*path, {});
  ASSERT_TRUE(result) << result.error().message;
  const Scene& scene = result->scene;
  EXPECT_GT(scene.triangle_count(), 0u);
  for (const Mesh& mesh : scene.meshes)
    for (const Vec3& n : mesh.normals) ASSERT_NEAR(length(n), 1.0f, 1e-5f) << mesh.name;
  std::printf("%s: %zu triangles, %zu meshes, %zu instances, %zu materials, %zu textures, %zu lights\n%s",
              GetParam(), scene.triangle_count(), scene.meshes.size(), scene.instances.size(),
              scene.materials.size(), scene.textures.size(), scene.lights.size(),
              test::all_notes(*result).c_str());

  ChunkStore store;
  const Digest id = write_scene(scene, store);
  ASSERT_TRUE(read_scene(*store.find(id), [&](const Digest& d) { return store.find(d); }));
  ChunkStore again;
  EXPECT_EQ(write_scene(import_scene(*path, {})->scene, again), id) << "two imports differ";
}

INSTANTIATE_TEST_SUITE_P(Shared, RealScene,
                         testing::Values("bevy_CornellBox.glb", "godot_room.glb", "living-room.glb",
                                         "MixedLightingExample.glb", "pc_house.glb", "sponza.glb",
                                         "sponza_lm.glb", "staircase.glb", "veach-bidir.glb", "zdm2.glb"),
                         [](const auto& info) {
                           std::string name = info.param;
                           for (char& c : name)
                             if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                           return name;
                         });

// The table of the scenes' own page: triangles in the file, less those without area.
TEST(RealScenes, SponzaKeepsItsTriangles) {
  const auto path = test::shared_scene("sponza.glb");
  if (!path) GTEST_SKIP() << "sponza.glb is not on this machine";
  const auto result = import_scene(*path, {});
  ASSERT_TRUE(result);
  EXPECT_LE(result->scene.triangle_count(), 262267u);
  EXPECT_GE(result->scene.triangle_count(), 262000u);
  EXPECT_EQ(result->scene.textures.size(), 24u);
}

}  // namespace
}  // namespace kiln
