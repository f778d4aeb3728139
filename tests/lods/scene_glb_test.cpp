// From the file to scene.glb: every level of a node gets its own coordinates, at two places and mirrored.
#include "common/base/files.h"
#include "coordinator/output/encode/output.h"
#include "tests/import/gltf_builder.h"
#include "tests/lods/crate.h"

namespace kiln {
namespace {
using namespace test;

int add_mesh(GltfBuilder& b, const Mesh& mesh) {
  std::vector<float> p, n;
  std::vector<uint32_t> indices;
  for (const Vec3& v : mesh.positions) p.insert(p.end(), {v.x, v.y, v.z});
  for (const Vec3& v : mesh.normals) n.insert(n.end(), {v.x, v.y, v.z});
  for (const UVec3& t : mesh.triangles) indices.insert(indices.end(), {t.x, t.y, t.z});
  const int position = b.vec3(p), normal = b.vec3(n), order = b.accessor_of(indices, 5125, "SCALAR", 1);
  return b.mesh({{"attributes", {{"POSITION", position}, {"NORMAL", normal}}}, {"indices", order}});
}

TEST(LevelsInSceneGlb, EveryLevelOfEveryPlaceGetsCoordinatesOfItsOwn) {
  GltfBuilder b;
  for (int level = 0; level < 3; ++level) add_mesh(b, crate_level(level));
  // Nodes 0 to 2 and 3 to 5: two crates, the second mirrored; node 6 is a proxy, for node 7.
  for (const int first : {0, 3})
    for (int level = 0; level < 3; ++level) {
      json node = {{"mesh", level}, {"name", "crate " + std::to_string(first + level)}};
      node["translation"] = {3.0 * first, 0.0, 0.0};
      node["scale"] = {first ? -1.0 : 1.0, 1.0, 1.0};
      if (level == 0) node["extensions"]["MSFT_lod"]["ids"] = {first + 1, first + 2};
      b.root["nodes"].push_back(node);
    }
  b.root["nodes"].push_back({{"mesh", 2}, {"name", "proxy"}, {"translation", {0, 0, 20}}});
  b.root["nodes"].push_back({{"mesh", 0},
                             {"name", "detailed"},
                             {"translation", {0, 0, 20}},
                             {"extras", {{"kiln", {{"proxy", "proxy"}}}}}});
  b.root["scenes"][0]["nodes"] = {0, 3, 7};
  b.root["extensionsUsed"] = {"MSFT_lod"};
  TempDir dir;
  const auto read = import_scene(write_glb_file(b, dir.path()), {});
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->scene.instances.size(), 3u);
  ASSERT_EQ(read->display.shown.size(), 5u);
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = 16;
  const auto atlas = build_atlas(read->scene, settings);
  ASSERT_TRUE(atlas);
  LodSettings lods;
  lods.distance = 0.1;
  const auto projection = project_display(read->display, read->scene, *atlas, lods);
  ASSERT_TRUE(projection) << projection.error().message;
  const Lightmap map;
  const BakeSettings bake;
  ASSERT_TRUE(
      write_gltf({bake, read->scene, *atlas, read->document, map, dir.path(), &read->display, &*projection}));
  // Read as levels again: what was drawn then has coordinates now, each its own mesh.
  const auto after = import_scene(dir.path() / "scene.glb", {});
  ASSERT_TRUE(after) << after.error().message;
  ASSERT_EQ(after->display.shown.size(), 5u);
  std::set<uint32_t> meshes;
  for (size_t i = 0; i < 5; ++i) {
    const DisplayMesh &was = read->display.shown[i], &is = after->display.shown[i];
    EXPECT_EQ(was.place.node, is.place.node);
    EXPECT_EQ(was.place.to_world[3], is.place.to_world[3]);
    meshes.insert(is.place.file_mesh);
    const Mesh& mesh = after->display.meshes[is.place.mesh];
    const ProjectedCharts& charts = projection->charts[i];
    ASSERT_EQ(mesh.triangles.size(), charts.charts.face_count());
    ASSERT_EQ(mesh.uv[1].size(), mesh.positions.size());
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) {
        const Vec2 texels = mesh.uv[1][mesh.triangles[t][k]] * Vec2(atlas->width, atlas->height);
        EXPECT_NEAR(length(texels - charts.charts.corner_uv[3 * t + static_cast<size_t>(k)]), 0, 1e-3);
      }
  }
  EXPECT_EQ(meshes.size(), 5u);
  // Baked level 0 has its own; the proxy stays as it was, without.
  EXPECT_FALSE(after->scene.meshes[after->scene.instances[0].mesh].uv[1].empty());
  EXPECT_EQ(after->scene.instances[2].file_mesh, 2u);
  EXPECT_TRUE(after->scene.meshes[after->scene.instances[2].mesh].uv[1].empty());
}

}  // namespace
}  // namespace kiln
