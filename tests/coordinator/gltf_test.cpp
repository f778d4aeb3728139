// scene.glb: the scene again, with TEXCOORD_1 that addresses the lightmap.
#include <array>
#include <map>
#include <nlohmann/json.hpp>

#include "common/atlas/atlas_lookup.h"
#include "common/base/files.h"
#include "coordinator/output/encode/output.h"
#include "coordinator/scene/import/import.h"
#include "tests/bake/scene_gltf.h"

namespace kiln {
namespace {

struct Written {
  ImportResult before, after;
  Atlas atlas;
};

Written write_and_read(const AtlasSettings& settings, const Scene& scene = test::small_room()) {
  test::TempDir dir;
  test::write_scene_glb(scene, dir.path() / "room.glb");
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
  settings.cut_contacts = false;
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

// Two instances of a 6 x 6 m floor of one quad; a wall without thickness stands on the first.
Scene floor_with_wall() {
  Scene s;
  Mesh floor, wall;
  floor.name = "floor";
  floor.positions = {{0, 0, 0}, {0, 0, 6}, {6, 0, 6}, {6, 0, 0}};
  floor.triangles = {{0, 1, 2}, {0, 2, 3}};
  floor.normals.assign(4, Vec3(0, 1, 0));
  wall.name = "wall";
  wall.positions = {{2.2f, 0, 0}, {2.2f, 0, 6}, {2.2f, 2, 6}, {2.2f, 2, 0}};
  wall.triangles = {{0, 1, 2}, {0, 2, 3}};
  wall.normals.assign(4, Vec3(-1, 0, 0));
  s.meshes = {floor, wall};
  s.materials.push_back({"metallic_roughness", "white", Mat4x3(1.0f), {}});
  for (int i = 0; i < 3; ++i) {
    Instance in;
    in.mesh = in.file_mesh = i == 2;
    in.node = static_cast<uint32_t>(i);
    in.name = "node" + std::to_string(i);
    if (i == 1) in.to_world[3] = Vec3(20, 0, 0);
    s.instances.push_back(in);
  }
  return s;
}

double area_of(const Scene& scene, size_t instance) {
  double area = 0;
  const Instance& in = scene.instances[instance];
  const Mesh& m = scene.meshes[in.mesh];
  for (const UVec3& t : m.triangles) {
    const DVec3 a(transform_point(in.to_world, m.positions[t.x]));
    area += 0.5 * length(cross(DVec3(transform_point(in.to_world, m.positions[t.y])) - a,
                               DVec3(transform_point(in.to_world, m.positions[t.z])) - a));
  }
  return area;
}

TEST(GltfOutput, TrianglesAreCutWhereChartsAreAndStayClosed) {
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  const Written w = write_and_read(settings, floor_with_wall());
  ASSERT_EQ(w.after.scene.instances.size(), 3u);
  EXPECT_EQ(w.atlas.statistics.cut_charts, 1u);
  EXPECT_EQ(w.after.scene.meshes[w.after.scene.instances[1].mesh].triangles.size(),
            2u);  // nothing stands on it
  const Instance& floor = w.after.scene.instances[0];
  const Mesh& m = w.after.scene.meshes[floor.mesh];
  EXPECT_GT(m.triangles.size(), 2u);
  EXPECT_NEAR(area_of(w.after.scene, 0), 36.0, 36 * 1e-6);
  const AtlasLookup lookup(w.atlas);
  using Place = std::array<float, 3>;
  std::map<std::pair<Place, Place>, int> sides;
  for (const UVec3& t : m.triangles) {
    Vec3 middle(0.0f);
    for (int k = 0; k < 3; ++k) middle += m.positions[t[k]] / 3.0f;
    // No triangle reaches over the wall.
    for (int k = 0; k < 3; ++k) EXPECT_GE((m.positions[t[k]].x - 2.2f) * (middle.x - 2.2f), -1e-5f);
    // Its middle is where the atlas has it.
    const bool second = middle.x > middle.z;
    const double b1 = second ? middle.z / 6 : (middle.z - middle.x) / 6;
    const double b2 = second ? (middle.x - middle.z) / 6 : middle.x / 6;
    const AtlasPlace place = lookup.at(0, second, b1, b2);
    const Vec2 uv = (m.uv[1][t.x] + m.uv[1][t.y] + m.uv[1][t.z]) / 3.0f * Vec2(w.atlas.width, w.atlas.height);
    EXPECT_NEAR(uv.x, place.texels.x, 2e-3);
    EXPECT_NEAR(uv.y, place.texels.y, 2e-3);
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = m.positions[t[k]], &b = m.positions[t[(k + 1) % 3]];
      ++sides[std::minmax(Place{a.x, a.y, a.z}, Place{b.x, b.y, b.z})];
    }
  }
  for (const auto& [side, count] : sides) {
    const auto on = [&](int axis, float value) {
      return side.first[axis] == value && side.second[axis] == value;
    };
    const bool border = on(0, 0) || on(0, 6) || on(2, 0) || on(2, 6);
    EXPECT_EQ(count, border ? 1 : 2) << side.first[0] << " " << side.first[2];
  }
}

PublishedProbeVolume published_volume(const std::string& name, std::optional<uint32_t> node) {
  PublishedProbeVolume v;
  v.name = name;
  v.node = node;
  v.high = DVec3(1, 2, 3);
  v.spacing = 0.5;
  v.levels = 3;
  v.visibility = node.has_value();
  return v;
}

// Writes a scene with probes over itself and returns its JSON.
nlohmann::json with_probes(const std::filesystem::path& scene, const PublishedProbes* probes) {
  const auto imported = import_scene(scene, {});
  EXPECT_TRUE(imported) << (imported ? "" : imported.error().message);
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  const auto atlas = build_atlas(imported->scene, settings);
  const Lightmap map;
  const BakeSettings bake;
  OutputContext context{bake, imported->scene, *atlas, imported->document, map, scene.parent_path()};
  context.probes = probes;
  EXPECT_TRUE(write_gltf(context));
  return nlohmann::json::parse(read_gltf_document(scene.parent_path() / "scene.glb")->json);
}

// A volume is on the node that asked for it, another on a node of its own, which a later bake uses again.
TEST(GltfOutput, NodesCarryVolumesOfProbes) {
  test::TempDir dir;
  test::write_scene_glb(test::small_room(), dir.path() / "scene.glb");
  const PublishedProbes two{90, {published_volume("hall", 1), published_volume("outside", {})}};
  const nlohmann::json first = with_probes(dir.path() / "scene.glb", &two);
  const nlohmann::json& root = first["extensions"]["KILN_probes"];
  EXPECT_EQ(root["light"]["uri"], "probes.exr");
  EXPECT_EQ(root["distance"]["uri"], "probes_distance.exr");
  EXPECT_EQ(root["probes"], 90);
  const nlohmann::json& hall = first["nodes"][1]["extensions"]["KILN_probes"];
  EXPECT_EQ(hall["volume"], 0);
  EXPECT_EQ(hall["max"], nlohmann::json({1.0, 2.0, 3.0}));
  EXPECT_EQ(hall["maxSpacing"], 2.0);
  EXPECT_EQ(hall["visibility"], true);
  const size_t last = first["nodes"].size() - 1;
  EXPECT_EQ(first["nodes"][last]["extensions"]["KILN_probes"]["volume"], 1);
  EXPECT_EQ(first["nodes"][last]["name"], "probes outside");
  EXPECT_EQ(first["scenes"][0]["nodes"].back(), last);
  const auto& used = first["extensionsUsed"];
  EXPECT_EQ(std::count(used.begin(), used.end(), "KILN_probes"), 1);

  const PublishedProbes one{8, {published_volume("again", {})}};
  const nlohmann::json second = with_probes(dir.path() / "scene.glb", &one);
  EXPECT_EQ(second["nodes"].size(), last + 1);
  EXPECT_FALSE(second["nodes"][1].value("extensions", nlohmann::json::object()).contains("KILN_probes"));
  EXPECT_EQ(second["nodes"][last]["name"], "probes again");
  EXPECT_FALSE(second["extensions"]["KILN_probes"].contains("distance"));

  const nlohmann::json third = with_probes(dir.path() / "scene.glb", nullptr);
  EXPECT_EQ(third.dump().find("KILN_probes"), std::string::npos);
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
