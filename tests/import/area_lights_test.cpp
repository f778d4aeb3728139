// extras.kiln.light of nodes: what is read, where the node puts it, and what is refused.
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;
using test::refused;
using N = std::vector<double>;

constexpr const char* kPanel = R"({"shape": "rectangle", "size": [2, 0.5], "radiance": [4, 5, 6]})";
constexpr const char* kRound = R"({"shape": "disc", "radius": 0.3, "radiance": [4, 0, 6]})";

// A triangle and a node 'lamp' with this light.
GltfBuilder with_light(const std::string& light, const char* node = "{}") {
  GltfBuilder b;
  b.node({{"mesh", b.triangle()}});
  json n = json::parse(node);
  n["name"] = "lamp";
  n["extras"]["kiln"]["light"] = json::parse(light);
  b.node(n);
  return b;
}
// The light with some members changed; null takes one away.
std::string changed(const char* light, const char* members) {
  json l = json::parse(light);
  l.merge_patch(json::parse(members));
  return l.dump();
}

Record only_light(const GltfBuilder& b) {
  const ImportResult r = imported(b);
  EXPECT_EQ(r.scene.lights.size(), 1u);
  EXPECT_EQ(test::note_with(r, "does not know"), "");
  EXPECT_EQ(test::note_with(r, "there is no light"), "");
  return r.scene.lights.empty() ? Record{} : r.scene.lights[0];
}

TEST(AreaLights, Rectangle) {
  const Record l = only_light(with_light(kPanel, R"({"translation": [1, 2, 3], "scale": [2, 3, 7]})"));
  EXPECT_EQ(l.type, "rectangle");
  EXPECT_EQ(l.name, "lamp");
  EXPECT_EQ(l.find("size")->numbers, (N{4, 1.5})) << "with the node's scale";
  EXPECT_EQ(l.find("radiance")->numbers, (N{4, 5, 6}));
  EXPECT_EQ(l.find("sides")->numbers, (N{1}));
  EXPECT_EQ(l.find("bake")->word, "full");
  EXPECT_EQ(l.to_world, Mat4x3(Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 2, 3)));
}

TEST(AreaLights, Disc) {
  const Record l =
      only_light(with_light(changed(kRound, R"({"sides": 2, "bake": "indirect"})"),
                            R"({"rotation": [0.70710678118, 0, 0, 0.70710678118], "scale": [2, 2, 0.1]})"));
  EXPECT_EQ(l.type, "disc");
  EXPECT_NEAR(l.find("radius")->numbers.at(0), 0.6, 1e-12);
  EXPECT_FALSE(l.find("size"));
  EXPECT_EQ(l.find("sides")->numbers, (N{2}));
  EXPECT_EQ(l.find("bake")->word, "indirect");
  // A quarter turn about x takes -z to +y.
  EXPECT_NEAR(length(-l.to_world[2] - Vec3(0, 1, 0)), 0, 1e-6f);
}

// Mirrored nodes and a z axis that leans keep the side that -z is on.
TEST(AreaLights, ShineOnTheSideOfMinusZ) {
  for (const char* node :
       {R"({"scale": [-1, 1, 1]})", R"({"scale": [1, 1, -1]})", R"({"scale": [-2, -1, -3]})",
        R"({"matrix": [1,0,0,0, 0,1,0,0, 0.5,0.3,-2,0, 0,0,0,1]})"}) {
    const Record l = only_light(with_light(kPanel, node));
    const json n = json::parse(node);
    const double z = n.contains("scale") ? n["scale"][2].get<double>() : -2.0;
    EXPECT_EQ(l.to_world[2], Vec3(0, 0, z < 0 ? -1 : 1)) << node;
    EXPECT_NEAR(determinant(l.to_world), 1, 1e-6f) << "a rotation";
  }
}

TEST(AreaLights, TheNodeHasTheLastWordOnBake) {
  GltfBuilder b = with_light(changed(kPanel, R"({"bake": "none"})"));
  EXPECT_EQ(only_light(b).find("bake")->word, "none");
  b.root["nodes"][1]["extras"]["kiln"]["bake"] = "indirect";
  EXPECT_EQ(only_light(b).find("bake")->word, "indirect");
}

TEST(AreaLights, StandBesideALightOfTheExtension) {
  GltfBuilder b = with_light(kPanel);
  b.root["extensionsUsed"] = {"KHR_lights_punctual"};
  b.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
  b.root["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = 0;
  const ImportResult r = imported(b);
  ASSERT_EQ(r.scene.lights.size(), 2u);
  EXPECT_EQ(r.scene.lights[0].type, "point");
  EXPECT_EQ(r.scene.lights[1].type, "rectangle");
}

TEST(AreaLights, BadOnesAreRefusedByTheNode) {
  const auto expect = [](const std::string& light, const std::string& message) {
    EXPECT_SAYS(refused(with_light(light)), "node 1 'lamp': extras.kiln.light" + message) << light;
  };
  expect("7", ": it is no object");
  expect(R"({"radiance": [1, 1, 1]})", ".shape: it is missing; it may be rectangle or disc");
  expect(changed(kPanel, R"({"shape": "tube"})"), ".shape: it is 'tube'; it may be rectangle or disc");
  expect(changed(kPanel, R"({"colour": [1, 1, 1]})"),
         ": a rectangle has no 'colour'; it has size, radiance, sides and bake");
  expect(changed(kRound, R"({"size": [1, 1]})"),
         ": a disc has no 'size'; it has radius, radiance, sides and bake");
  for (const char* size : {"null", "[1]", "[1, 0]", "[-1, 1]", "[1, \"2\"]", "1", "[1, 1, 1]"})
    expect(changed(kPanel, (std::string(R"({"size": )") + size + "}").c_str()),
           ".size: it has to be two numbers of metres above 0");
  for (const char* radius : {"null", "0", "-1", "\"1\"", "[1, 2]"})
    expect(changed(kRound, (std::string(R"({"radius": )") + radius + "}").c_str()),
           ".radius: it has to be a number of metres above 0");
  expect(changed(kRound, R"({"radius": 1e200})"), ".radius: with the node's scale it is 1e+200 m");
  expect(changed(kRound, R"({"radius": 1e-60})"), ".radius: with the node's scale it is 1e-60 m");
  for (const char* radiance :
       {"null", "[1, 1]", "[0, 0, 0]", "[1, -1, 1]", "[1, 1e60, 1]", "5", "[1e-60, 0, 0]"})
    expect(changed(kPanel, (std::string(R"({"radiance": )") + radiance + "}").c_str()),
           ".radiance: it has to be three finite numbers of at least 0, one of them above 0");
  for (const char* sides : {"0", "3", "1.5", "\"2\"", "true"})
    expect(changed(kPanel, (std::string(R"({"sides": )") + sides + "}").c_str()), ".sides: it may be 1 or 2");
  expect(changed(kPanel, R"({"bake": "maybe"})"), ".bake: it may be full, indirect or none");
}

TEST(AreaLights, TransformsThatLeaveNoShapeAreRefused) {
  for (const char* light : {kPanel, kRound}) {
    EXPECT_SAYS(refused(with_light(light, R"({"scale": [1, 0, 1]})")),
                "node 1 'lamp': extras.kiln.light: the node's transform leaves the light no plane");
    EXPECT_SAYS(refused(with_light(light, R"({"matrix": [1,0,0,0, 0.3,1,0,0, 0,0,1,0, 0,0,0,1]})")),
                "the node's transform shears the");
  }
  EXPECT_SAYS(refused(with_light(kRound, R"({"scale": [1, 2, 1]})")),
              "makes an ellipse of the disc, with scales 1 and 2 of x and y");
  // Below a stretched parent a turned node is sheared.
  GltfBuilder b = with_light(kPanel, R"({"rotation": [0, 0, 0.38268343, 0.92387953]})");
  b.root["nodes"].push_back({{"scale", {1, 2, 1}}, {"children", {1}}});
  b.root["scenes"][0]["nodes"] = {0, 2};
  EXPECT_SAYS(refused(b), "shears the rectangle");
  b.root["nodes"][2]["scale"] = {2, 2, 2};
  EXPECT_EQ(only_light(b).find("size")->numbers.size(), 2u);
}

}  // namespace
}  // namespace kiln
