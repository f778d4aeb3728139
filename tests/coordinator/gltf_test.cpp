// scene.glb: the scene again, with TEXCOORD_1 that addresses the lightmap.
#include "common/base/files.h"
#include "coordinator/encode/output.h"
#include "coordinator/import/import.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

struct Written {
  ImportResult before, after;
  Atlas atlas;
};

Written write_and_read(const AtlasSettings& settings) {
  test::TempDir dir;
  test::write_scene_glb(test::small_room(), dir.path() / "room.glb");
  auto before = import_scene(dir.path() / "room.glb", {});
  EXPECT_TRUE(before);
  auto atlas = build_atlas(before->scene, settings);
  EXPECT_TRUE(atlas);
  const Lightmap map;
  const BakeSettings bake;
  EXPECT_TRUE(write_gltf({bake, before->scene, *atlas, before->document, map, dir.path()}));
  auto after = import_scene(dir.path() / "scene.glb", {});
  EXPECT_TRUE(after) << after.error().message;
  return {std::move(*before), std::move(*after), std::move(*atlas)};
}

TEST(GltfOutput, EveryTriangleKeepsItsPlaceAndGetsItsTexels) {
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = 8;
  const Written w = write_and_read(settings);
  ASSERT_EQ(w.after.scene.instances.size(), w.before.scene.instances.size());
  EXPECT_EQ(w.after.scene.lights.size(), w.before.scene.lights.size());
  EXPECT_EQ(w.after.scene.materials.size(), w.before.scene.materials.size());
  for (size_t i = 0; i < w.before.scene.instances.size(); ++i) {
    const Instance &a = w.before.scene.instances[i], &b = w.after.scene.instances[i];
    const Mesh &ma = w.before.scene.meshes[a.mesh], &mb = w.after.scene.meshes[b.mesh];
    ASSERT_EQ(ma.triangles.size(), mb.triangles.size());
    ASSERT_EQ(mb.uv[1].size(), mb.positions.size());
    for (size_t t = 0; t < ma.triangles.size(); ++t) {
      const uint32_t chart = w.atlas.charts[a.mesh].chart_of_face[t];
      const ChartPlacement& place = w.atlas.placements[w.atlas.instance_first_chart[i] + chart];
      for (int c = 0; c < 3; ++c) {
        EXPECT_EQ(transform_point(a.to_world, ma.positions[ma.triangles[t][c]]),
                  transform_point(b.to_world, mb.positions[mb.triangles[t][c]]));
        const Vec2 texels(place.to_texels(DVec2(w.atlas.charts[a.mesh].corner_uv[3 * t + c])));
        const Vec2 written = mb.uv[1][mb.triangles[t][c]] * Vec2(w.atlas.width, w.atlas.height);
        EXPECT_NEAR(written.x, texels.x, 1e-3f);
        EXPECT_NEAR(written.y, texels.y, 1e-3f);
      }
    }
  }
}

TEST(GltfOutput, TheWrittenCoordinatesAreAValidAtlas) {
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  const Written w = write_and_read(settings);
  AtlasSettings again;
  again.layout = AtlasSettings::Layout::kAtlas;
  again.width = w.atlas.width;
  again.height = w.atlas.height;
  const auto atlas = build_atlas(w.after.scene, again);
  ASSERT_TRUE(atlas) << atlas.error().message;
  EXPECT_EQ(atlas->sites.size(), w.atlas.sites.size());
}

TEST(GltfOutput, ImagesOutsideTheScenesFolderAreNotEmbedded) {
  test::TempDir dir;
  std::filesystem::create_directories(dir.path() / "scene");
  ASSERT_TRUE(write_file_atomic(dir.path() / "secret.png", "SECRET-OUTSIDE"));
  ASSERT_TRUE(write_file_atomic(dir.path() / "scene/wall.png", "PICTURE-BESIDE"));
  GltfDocument document;
  document.path = dir.path() / "scene/x.gltf";
  document.json = R"({"asset":{"version":"2.0"},"images":[{"uri":"../secret.png"},{"uri":")" +
                  (dir.path() / "secret.png").string() + R"("},{"uri":"wall.png"}]})";
  const Scene scene;
  Atlas atlas;
  atlas.width = atlas.height = 1;
  ASSERT_TRUE(write_gltf({BakeSettings{}, scene, atlas, document, Lightmap{}, dir.path()}));
  const Bytes glb = *read_file(dir.path() / "scene.glb");
  const std::string text(reinterpret_cast<const char*>(glb.data()), glb.size());
  EXPECT_EQ(text.find("SECRET-OUTSIDE"), std::string::npos);
  EXPECT_NE(text.find("PICTURE-BESIDE"), std::string::npos);
}

}  // namespace
}  // namespace kiln
