// extras.kiln.density and extras.kiln.importance: what a file may say, and what it may not.
#include <cmath>
#include <fstream>
#include <regex>
#include <sstream>

#include "common/scene/prepared.h"
#include "tests/density/squares.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;
using test::kiln_extras;
using test::refused;
using test::square_at;
using test::square_meshes;

json with_density(json element, json density) {
  element["extras"] = kiln_extras({{"density", std::move(density)}});
  return element;
}

TEST(DensityExtras, NodeAncestorsMeshAndMaterialMultiply) {
  GltfBuilder b = square_meshes(1);
  b.root["nodes"] = {with_density({{"children", {1, 2}}}, 2),
                     with_density(square_at("child", 0), 0.5),
                     {{"name", "plain"}, {"mesh", 1}},
                     square_at("other", 5)};
  b.root["scenes"][0]["nodes"] = {0, 3};
  b.root["meshes"][1]["extras"] = kiln_extras({{"density", 3}});
  b.root["materials"][0]["extras"] = kiln_extras({{"density", 5}});
  const ImportResult r = imported(b);
  ASSERT_EQ(r.scene.instances.size(), 3u);
  EXPECT_EQ(r.density.by_instance, (std::vector<float>{2 * 0.5f, 2 * 3 * 5, 1}));
  EXPECT_EQ(test::note_with(r, "clamped"), "");
}

TEST(DensityExtras, NothingSaidIsNothingStored) {
  GltfBuilder b = square_meshes(1);
  b.node(square_at("a", 0));
  EXPECT_TRUE(imported(b).density.by_instance.empty());
  EXPECT_TRUE(imported(b).density.boxes.empty());
}

// What workers are sent stays as it was, so a scene keeps its name.
TEST(DensityExtras, AreNoPartOfTheScene) {
  GltfBuilder plain = square_meshes(1), said = plain;
  plain.node(square_at("a", 0));
  said.node(with_density(square_at("a", 0), 3));
  ChunkStore chunks;
  EXPECT_EQ(write_scene(imported(plain).scene, chunks).hex(),
            write_scene(imported(said).scene, chunks).hex());
}

TEST(DensityExtras, BeyondTheRangeIsClampedAndNoted) {
  GltfBuilder b = square_meshes(1);
  b.node(with_density(square_at("huge", 0), 1e300));
  b.node(with_density(square_at("tiny", 2), 1e-300));
  b.node(square_at("plain", 4));
  const ImportResult r = imported(b);
  EXPECT_EQ(r.density.by_instance, (std::vector<float>{64, 1.0f / 64, 1}));
  EXPECT_SAYS(test::note_with(r, "clamped to 1/64 to 64"), "2 elements: node 0 'huge' (1e+300)");
}

TEST(DensityExtras, DeepTreesStayFinite) {
  GltfBuilder b = square_meshes(1);
  constexpr int kDepth = 5000;  // 64^2500 is beyond doubles
  for (int i = 0; i < kDepth; ++i)
    b.root["nodes"].push_back(with_density({{"children", {i + 1}}}, i < kDepth / 2 ? 64 : 1.0 / 64));
  b.root["nodes"].push_back(square_at("leaf", 0));
  b.root["scenes"][0]["nodes"] = {0};
  const ImportResult r = imported(b);
  ASSERT_EQ(r.density.by_instance.size(), 1u);
  EXPECT_GE(r.density.by_instance[0], 1.0f / 64);
  EXPECT_LE(r.density.by_instance[0], 64.0f);
}

TEST(DensityExtras, WhatIsNoDensityIsRefusedByName) {
  for (const char* bad : {"-1", "0", "-0.0", "\"NaN\"", "\"2\"", "[2]", "{\"x\": 1}", "true"}) {
    GltfBuilder node = square_meshes(1), mesh = node, material = node;
    node.node(with_density(square_at("n", 0), json::parse(bad)));
    EXPECT_SAYS(refused(node), "node 0 'n': extras.kiln.density is ") << bad;
    mesh.node(square_at("n", 0));
    mesh.root["meshes"][0] = with_density(mesh.root["meshes"][0], json::parse(bad));
    EXPECT_SAYS(refused(mesh), "mesh 0: extras.kiln.density is ") << bad;
    material.node(square_at("n", 0));
    material.root["materials"][0] = with_density(material.root["materials"][0], json::parse(bad));
    EXPECT_SAYS(refused(material), "material 0 'paint': extras.kiln.density is ") << bad;
  }
}

GltfBuilder with_importance(json importance) {
  GltfBuilder b = square_meshes(1);
  b.node(square_at("a", 0));
  b.root["scenes"][0]["extras"] = kiln_extras({{"importance", std::move(importance)}});
  return b;
}

TEST(ImportanceExtras, BoxesAreRead) {
  const auto r = imported(
      with_importance(json::parse(R"([{"box": {"min": [1, 2, 3], "max": [4, 5, 6]}, "density": 2}])")));
  ASSERT_EQ(r.density.boxes.size(), 1u);
  EXPECT_EQ(r.density.boxes[0].low, DVec3(1, 2, 3));
  EXPECT_EQ(r.density.boxes[0].high, DVec3(4, 5, 6));
  EXPECT_EQ(r.density.boxes[0].factor, 2);
}

TEST(ImportanceExtras, WhatIsNoBoxIsRefused) {
  const auto message = [](const char* importance) {
    return refused(with_importance(json::parse(importance)));
  };
  EXPECT_SAYS(message("3"), "extras.kiln.importance of the scene: it is no list");
  EXPECT_SAYS(message("[3]"), "entry 0: box is not");
  EXPECT_SAYS(message(R"([{"box": {"min": [0, 0], "max": [1, 1, 1]}, "density": 2}])"),
              "entry 0: box is not");
  EXPECT_SAYS(message(R"([{"box": {"min": [0, 0, 2], "max": [1, 1, 1]}, "density": 2}])"),
              "min 2 above max 1");
  EXPECT_SAYS(message(R"([{"box": {"min": [0, 0, 0], "max": [1, 1, 1]}}])"), "entry 0: it has no density");
  EXPECT_SAYS(message(R"([{"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "density": -2}])"),
              "extras.kiln.density is -2");
  json many = json::array();
  for (int i = 0; i < 257; ++i)
    many.push_back(json::parse(R"({"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "density": 2})"));
  EXPECT_SAYS(refused(with_importance(many)), "it has 257 boxes, 256 is the most");
}

TEST(DensityCameras, EveryPerspectiveCameraCounts) {
  GltfBuilder b = square_meshes(1);
  b.node(square_at("a", 0));
  b.root["cameras"] =
      json::parse(R"([{"type": "perspective", "perspective": {"yfov": 0.5, "aspectRatio": 2, "znear": 0.1}},
    {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "zfar": 9, "znear": 0.1}},
    {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}])");
  for (int camera = 0; camera < 3; ++camera) b.node({{"camera", camera}, {"translation", {camera, 0, 0}}});
  const ImportResult r = imported(b);
  ASSERT_EQ(r.density.cameras.size(), 2u);
  EXPECT_EQ(r.density.cameras[0].aspect, 2);
  EXPECT_NEAR(r.density.cameras[1].aspect, 16.0f / 9, 1e-6f);
  EXPECT_EQ(r.density.cameras[1].to_world[3], Vec3(2, 0, 0));
  EXPECT_NEAR(r.cameras.at(0).vertical_fov, 0.5f, 1e-6f);
}

// Every extras.kiln.NAME that a message of the importer names has its row in docs/scenes.md.
TEST(Docs, ListEveryExtra) {
  const auto read = [](const std::filesystem::path& path) {
    std::ostringstream out;
    out << std::ifstream(path).rdbuf();
    return out.str();
  };
  const std::string page = read(test::source_dir() / "docs/scenes.md");
  const std::regex extra(R"(extras\.kiln\.([a-z_]+))");
  std::set<std::string> names;
  for (const auto& file :
       std::filesystem::directory_iterator(test::source_dir() / "coordinator/scene/import")) {
    const std::string code = read(file.path());
    for (std::sregex_iterator at(code.begin(), code.end(), extra), end; at != end; ++at)
      names.insert((*at)[1]);
  }
  EXPECT_GE(names.size(), 4u);
  for (const std::string& name : names)
    EXPECT_NE(page.find("extras.kiln." + name + "`"), std::string::npos) << name;
}

}  // namespace
}  // namespace kiln
