#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;
using test::refused;
using N = std::vector<double>;

// A triangle and one node with this light.
GltfBuilder with_light(const char* light, const char* node = "{}") {
  GltfBuilder b;
  b.node({{"mesh", b.triangle()}});
  b.root["extensionsUsed"] = {"KHR_lights_punctual"};
  b.root["extensions"]["KHR_lights_punctual"]["lights"] = {json::parse(light)};
  json n = json::parse(node);
  n["extensions"]["KHR_lights_punctual"]["light"] = 0;
  b.node(n);
  return b;
}

Record only_light(const GltfBuilder& b, const BakeSettings& settings = {}) {
  const Scene scene = imported(b, settings).scene;
  EXPECT_EQ(scene.lights.size(), 1u);
  return scene.lights.empty() ? Record{} : scene.lights[0];
}

TEST(Lights, Point) {
  const Record l = only_light(
      with_light(R"({"type": "point", "name": "bulb", "color": [1, 0.5, 0], "intensity": 30, "range": 4})",
                 R"({"translation": [1, 2, 3], "scale": [2, 2, 2]})"));
  EXPECT_EQ(l.type, "point");
  EXPECT_EQ(l.name, "bulb");
  EXPECT_EQ(l.find("color")->numbers, (N{1, 0.5, 0}));
  EXPECT_EQ(l.find("intensity")->numbers, (N{30}));
  EXPECT_EQ(l.find("range")->numbers, (N{4}));
  EXPECT_EQ(l.find("bake")->word, "full");
  EXPECT_EQ(l.to_world[3], Vec3(1, 2, 3));
}

TEST(Lights, DefaultsOfTheExtension) {
  const Record point = only_light(with_light(R"({"type": "point"})"));
  EXPECT_EQ(point.find("color")->numbers, (N{1, 1, 1}));
  EXPECT_EQ(point.find("intensity")->numbers, (N{1}));
  EXPECT_FALSE(point.find("range")) << "absent: no limit";
  const Record spot = only_light(with_light(R"({"type": "spot", "spot": {}})"));
  EXPECT_EQ(spot.find("inner")->numbers, (N{0}));
  EXPECT_NEAR(spot.find("outer")->numbers.at(0), 0.78539816, 1e-8);
}

TEST(Lights, DirectionalShinesAlongMinusZ) {
  BakeSettings settings;
  settings.sun_angle = 0.53;
  // A quarter turn about x takes -z to +y.
  const Record l =
      only_light(with_light(R"({"type": "directional", "intensity": 5})",
                            R"({"rotation": [0.70710678118, 0, 0, 0.70710678118], "scale": [3, 3, 3]})"),
                 settings);
  EXPECT_NEAR(length(-l.to_world[2] - Vec3(0, 1, 0)), 0, 1e-6f);
  EXPECT_EQ(l.find("angle")->numbers, (N{0.53}));
}

TEST(Lights, SpotCones) {
  const Record l =
      only_light(with_light(R"({"type": "spot", "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.4}})"));
  EXPECT_EQ(l.find("inner")->numbers, (N{0.2}));
  EXPECT_EQ(l.find("outer")->numbers, (N{0.4}));
  const ImportResult bad =
      imported(with_light(R"({"type": "spot", "spot": {"innerConeAngle": 2, "outerConeAngle": 9}})"));
  const double inner = bad.scene.lights.at(0).find("inner")->numbers[0],
               outer = bad.scene.lights[0].find("outer")->numbers[0];
  EXPECT_TRUE(inner >= 0 && inner < outer && outer <= 1.5708);
  EXPECT_SAYS(test::all_notes(bad), "light 0: cone angles 2 and 9 are clamped");
}

TEST(Lights, BakeWord) {
  const auto word = [](const char* light, const char* node) {
    return only_light(with_light(light, node)).find("bake")->word;
  };
  EXPECT_EQ(word(R"({"type": "point", "extras": {"kiln": {"bake": "indirect"}}})", "{}"), "indirect");
  EXPECT_EQ(word(R"({"type": "point"})", R"({"extras": {"kiln": {"bake": "none"}}})"), "none");
  EXPECT_EQ(word(R"({"type": "point", "extras": {"kiln": {"bake": "none"}}})",
                 R"({"extras": {"kiln": {"bake": "full"}}})"),
            "full")
      << "the node has the last word";
  EXPECT_SAYS(refused(with_light(R"({"type": "point", "name": "a", "extras": {"kiln": {"bake": "maybe"}}})")),
              "light 0 'a': extras.kiln.bake is 'maybe'; it may be full, indirect or none");
  EXPECT_SAYS(refused(with_light(R"({"type": "point"})", R"({"extras": {"kiln": {"bake": 7}}})")),
              "node 1: extras.kiln.bake");
}

TEST(Lights, BadOnes) {
  EXPECT_SAYS(refused(with_light(R"({"type": "laser"})")), "light 0: type 'laser' does not exist");
  EXPECT_SAYS(refused(with_light(R"({"type": "point", "intensity": -2})")),
              "light 0: intensity -2 is not a valid intensity");
  EXPECT_SAYS(refused(with_light(R"({"type": "point", "color": [1, 2]})")),
              "light 0: its color has 2 numbers");
  EXPECT_SAYS(refused(with_light(R"({"type": "point", "color": [1, -2, 0]})")),
              "light 0: its color has the component -2");
  GltfBuilder b = with_light(R"({"type": "point"})");
  b.root["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = 5;
  EXPECT_SAYS(refused(b), "node 1: light 5 does not exist, there are 1");
  const ImportResult aimless = imported(with_light(R"({"type": "directional"})", R"({"scale": [0, 0, 0]})"));
  EXPECT_TRUE(aimless.scene.lights.empty());
  EXPECT_SAYS(test::all_notes(aimless),
              "leaves no direction are left out: take away scales of 0, in 1 node: node 1");
  EXPECT_EQ(imported(with_light(R"({"type": "point"})", R"({"scale": [0, 0, 0]})")).scene.lights.size(), 1u);
}

TEST(Lights, SunsOfTheSettings) {
  BakeSettings settings;
  settings.suns.push_back({{0, 3, 4}, {5, 6, 7}});
  settings.sun_angle = 0.5;
  GltfBuilder b;
  b.node({{"mesh", b.triangle()}});
  const Record sun = only_light(b, settings);
  EXPECT_EQ(sun.type, "directional");
  EXPECT_NEAR(length(-sun.to_world[2] - Vec3(0, -0.6f, -0.8f)), 0, 1e-6f)
      << "-z points from the light to the scene";
  EXPECT_EQ(sun.find("color")->numbers, (N{5, 6, 7}));
  EXPECT_EQ(sun.find("intensity")->numbers, (N{1}));
  EXPECT_EQ(sun.find("angle")->numbers, (N{0.5}));
}

TEST(Lights, NoneAtAllIsAWarning) {
  GltfBuilder dark = with_light(R"({"type": "point", "intensity": 0})");
  const ImportResult r = imported(dark);
  EXPECT_TRUE(r.scene.lights.empty());
  EXPECT_SAYS(test::note_with(r, "there is no light"),
              "The map will be black; --environment or --sun adds one");
  const auto warns = [](const GltfBuilder& b, const BakeSettings& settings = {}) {
    return !test::note_with(imported(b, settings), "there is no light").empty();
  };
  EXPECT_FALSE(warns(with_light(R"({"type": "point"})")));
  GltfBuilder emissive;
  emissive.textured_triangle({{"emissiveFactor", {0, 1, 0}}});
  EXPECT_FALSE(warns(emissive));
  BakeSettings sky;
  sky.environment = "1,1,1";
  EXPECT_FALSE(warns(dark, sky));
  sky.environment = "0,0,0";
  EXPECT_TRUE(warns(dark, sky));
}

}  // namespace
}  // namespace kiln
