// The node tree: transforms, instancing, and trees that are none.
#include "coordinator/scene/import/affine.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;
using test::refused;

GltfBuilder with_nodes(const char* nodes, const char* roots) {
  GltfBuilder b;
  b.triangle();
  b.root["nodes"] = json::parse(nodes);
  b.root["scenes"][0]["nodes"] = json::parse(roots);
  return b;
}

TEST(Nodes, TransformsCompose) {
  // Parent: moved by (1,2,3), turned by 90 degrees about z. Child: scaled by 2, moved by (1,0,0).
  const auto b = with_nodes(R"([
    {"translation": [1, 2, 3], "rotation": [0, 0, 0.70710678118654752, 0.70710678118654752], "children": [1, 2]},
    {"mesh": 0, "name": "trs", "translation": [1, 0, 0], "scale": [2, 2, 2]},
    {"mesh": 0, "name": "matrix", "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 0, 0, 1]}])",
                            "[0]");
  const Scene scene = imported(b).scene;
  ASSERT_EQ(scene.instances.size(), 2u);
  for (const Instance& i : scene.instances) {
    EXPECT_NEAR(length(transform_point(i.to_world, {0, 0, 0}) - Vec3(1, 3, 3)), 0, 1e-6f) << i.name;
    EXPECT_NEAR(length(transform_point(i.to_world, {1, 0, 0}) - Vec3(1, 5, 3)), 0, 1e-6f) << i.name;
    EXPECT_NEAR(length(transform_point(i.to_world, {0, 1, 0}) - Vec3(-1, 3, 3)), 0, 1e-6f) << i.name;
  }
  EXPECT_EQ(scene.instances[0].name, "trs");
  EXPECT_EQ(scene.instances[1].node, 2u);
}

TEST(Nodes, MirroredInstancesStay) {
  const Scene scene = imported(with_nodes(R"([{"mesh": 0, "scale": [-1, 1, 1]}])", "[0]")).scene;
  ASSERT_EQ(scene.instances.size(), 1u);
  EXPECT_LT(determinant(scene.instances[0].to_world), 0);
}

TEST(Nodes, SingularTransformsAreLeftOutWithANote) {
  const auto b = with_nodes(R"([{"mesh": 0}, {"mesh": 0, "name": "hidden", "scale": [0, 0, 0]},
    {"mesh": 0, "name": "squashed", "scale": [1, 0, 1], "rotation": [0.1, 0.5, 0.3, 0.8]},
    {"mesh": 0, "name": "thin", "scale": [1, 1e-5, 1]}])",
                            "[0, 1, 2, 3]");
  const ImportResult r = imported(b);
  EXPECT_EQ(r.scene.instances.size(), 2u);
  EXPECT_SAYS(test::note_with(r, "singular"), "2 places: node 1 'hidden', node 2 'squashed'");
  for (const ImportNote& note : r.notes)
    if (test::says(note.what, "singular")) EXPECT_EQ(note.kind, ImportNote::Kind::kNote);
}

TEST(Nodes, TreesThatAreNone) {
  EXPECT_SAYS(
      refused(with_nodes(R"([{"mesh": 0}, {"name": "a", "children": [2]}, {"children": [1]}])", "[0]")),
      "x.glb: node 1 'a' is its own ancestor: the nodes form a cycle");
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 0, "children": [0]}])", "[0]")), "node 0 is its own ancestor");
  EXPECT_SAYS(refused(with_nodes(R"([{"children": [2]}, {"children": [2]}, {"mesh": 0}])", "[0, 1]")),
              "node 2 has two parents, node 0 and node 1");
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 0, "children": [7]}])", "[0]")),
              "node 0: child 7 does not exist, there are 1 nodes");
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 0, "children": [-3]}])", "[0]")), "child -3 does not exist");
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 0}])", "[4]")), "the scene names node 4, there are 1");
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 0}])", "[0, 0]")), "which it has named already");
  EXPECT_SAYS(refused(with_nodes(R"([{"children": [1]}, {"mesh": 0}])", "[0, 1]")),
              "is a child of another node");
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 3}])", "[0]")), "node 0: mesh 3 does not exist, there are 1");
}

TEST(Nodes, TransformsThatAreNone) {
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 0, "scale": [1, 1]}])", "[0]")),
              "node 0: its scale has 2 numbers");
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 0, "rotation": [1]}])", "[0]")),
              "node 0: its rotation has 1 numbers");
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 0, "matrix": [1, 2, 3]}])", "[0]")),
              "node 0: its matrix has 3 numbers");
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 0, "translation": [1e300, 0, 0]}])", "[0]")),
              "its transform is not finite");
  EXPECT_SAYS(refused(with_nodes(R"([{"mesh": 0, "translation": [1e20, 0, 0]}])", "[0]")), "from the origin");
}

TEST(Nodes, DepthIsNoStack) {
  json nodes = json::array();
  constexpr int kDepth = 200000;
  for (int i = 0; i < kDepth; ++i) nodes.push_back({{"children", {i + 1}}});
  nodes.push_back({{"mesh", 0}});
  GltfBuilder b;
  b.triangle();
  b.root["nodes"] = nodes;
  b.root["scenes"][0]["nodes"] = {0};
  EXPECT_EQ(imported(b).scene.instances.size(), 1u);
}

TEST(Nodes, WhichScene) {
  GltfBuilder b = with_nodes(R"([{"mesh": 0}, {"mesh": 0}, {"mesh": 0, "name": "other"}])", "[0, 1]");
  b.root["scenes"].push_back({{"nodes", {2}}});
  EXPECT_EQ(imported(b).scene.instances.size(), 2u);
  b.root["scene"] = 1;
  EXPECT_EQ(imported(b).scene.instances.at(0).name, "other");
  b.root.erase("scene");
  EXPECT_EQ(imported(b).scene.instances.size(), 2u) << "the first";
  b.root.erase("scenes");
  EXPECT_EQ(imported(b).scene.instances.size(), 3u) << "all roots";
  b.root["scenes"] = json::array();
  b.root["scene"] = 0;
  EXPECT_SAYS(refused(b), "scene 0 does not exist, there are 0");
}

TEST(Nodes, GpuInstancing) {
  GltfBuilder b;
  b.root["extensionsUsed"] = b.root["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  const int mesh = b.triangle();
  const int at = b.vec3({1, 0, 0, 2, 0, 0, 3, 0, 0}), scale = b.vec3({1, 1, 1, 2, 2, 2, 0, 0, 0});
  const int turn = b.accessor(b.view(std::vector<int16_t>{0, 0, 0, 32767, 0, 0, 32767, 0, 0, 0, 0, 32767}),
                              5122, 3, "VEC4");
  b.root["accessors"][turn]["normalized"] = true;
  json node = {{"mesh", mesh}, {"translation", {0, 10, 0}}};
  auto& attributes = node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  attributes = {{"TRANSLATION", at}, {"ROTATION", turn}, {"SCALE", scale}};
  b.node(node);
  const ImportResult r = imported(b);
  ASSERT_EQ(r.scene.instances.size(), 2u) << "the third has no size";
  EXPECT_EQ(r.scene.meshes.size(), 1u);
  EXPECT_EQ(r.scene.instances[0].to_world[3], Vec3(1, 10, 0));
  // Half a turn about z, then 2 along x: the corner (1, 0, 0) is at 2 - 2.
  EXPECT_NEAR(length(transform_point(r.scene.instances[1].to_world, {1, 0, 0}) - Vec3(0, 10, 0)), 0, 1e-6f);

  b.root["accessors"][scale]["count"] = 2;
  EXPECT_SAYS(refused(b), "node 0: EXT_mesh_gpu_instancing SCALE has 2 elements, another attribute 3");
  b.root["accessors"][scale]["count"] = 9;
  EXPECT_SAYS(refused(b), "(node 0: EXT_mesh_gpu_instancing SCALE)");
}

TEST(Nodes, SkinsAndMorphTargetsAreSaid) {
  GltfBuilder b;
  const int position = b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const int mesh =
      b.mesh({{"attributes", {{"POSITION", position}}}, {"targets", {{{"POSITION", position}}}}});
  b.root["skins"] = {{{"joints", {0}}}};
  b.node({{"mesh", mesh}, {"skin", 0}});
  const ImportResult r = imported(b);
  EXPECT_SAYS(test::all_notes(r), "skins are left out: the base pose is baked, in 1 node: node 0");
  EXPECT_SAYS(test::all_notes(r), "morph targets are left out: the base shape is baked, in 1 primitive");
}

TEST(Nodes, FirstPerspectiveCamera) {
  GltfBuilder b = test::small_scene();
  b.root["cameras"] = json::parse(R"([
    {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}},
    {"type": "perspective", "name": "view", "perspective": {"yfov": 0.7, "znear": 0.1}}])");
  b.node({{"camera", 0}});
  b.node({{"camera", 1}, {"translation", {1, 2, 3}}, {"scale", {5, 5, 5}}});
  const ImportResult r = imported(b);
  ASSERT_EQ(r.cameras.size(), 1u);
  EXPECT_EQ(r.cameras[0].name, "view");
  EXPECT_FLOAT_EQ(r.cameras[0].vertical_fov, 0.7f);
  EXPECT_EQ(r.cameras[0].to_world[3], Vec3(1, 2, 3));
  EXPECT_EQ(r.cameras[0].to_world[1], Vec3(0, 1, 0)) << "scale is not the camera's";
  EXPECT_TRUE(imported(test::small_scene()).cameras.empty());
}

TEST(Affine, SingularIsAboutTheAxesNotTheirSize) {
  const auto singular = [](const DVec3& x, const DVec3& y, const DVec3& z) {
    return is_singular({x, y, z, DVec3(0)});
  };
  EXPECT_FALSE(singular({1e-9, 0, 0}, {0, 1, 0}, {0, 0, 1000}));
  EXPECT_TRUE(singular({1, 0, 0}, {0, 1, 0}, {1, 1, 1e-9})) << "in a plane, as floats have it";
  EXPECT_FALSE(singular({1, 0, 0}, {0, 1, 0}, {1, 1, 1e-5}));
  EXPECT_TRUE(singular({1, 0, 0}, {0, 1, 0}, {0, 0, 0}));
  EXPECT_TRUE(singular({1e-20, 0, 0}, {0, 1e-20, 0}, {0, 0, 1e-20})) << "its float determinant vanishes";
}

TEST(Affine, RigidPartKeepsTheAxis) {
  const double q[4] = {0.1, -0.4, 0.3, 0.85};
  const Affine a = from_trs({1, 2, 3}, q, {-2, 3, 0.5});
  Mat4x3 m{1.0f};
  ASSERT_TRUE(rigid_part(a, m));
  EXPECT_NEAR(length(m[2] - normalize_or(Vec3(a.z), Vec3(0))), 0, 1e-6f);
  EXPECT_NEAR(determinant(m), 1, 1e-5f);
  Affine none = a;
  none.z = DVec3(0);
  EXPECT_FALSE(rigid_part(none, m));
}

}  // namespace
}  // namespace kiln
