// --lamps: which lamps scene.glb and scene_unlit.glb still have.
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/files.h"
#include "coordinator/output/encode/output.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {

using test::json;

constexpr const char* kPunctual = "KHR_lights_punctual";
const char kIesFile[] = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 0\n0 45 90\n0\n100 50 10\n";

json lamp(const char* name, int light) {
  return {{"name", name}, {"extensions", {{kPunctual, {{"light", light}}}}}};
}

// Every kind of light, in the map or not; `skyless`: without one that shines from all sides.
test::GltfBuilder scene_of_lamps(bool skyless = false) {
  test::GltfBuilder b;
  const int plain = b.triangle();
  b.node({{"name", "floor"}, {"mesh", plain}});
  b.root["extensionsUsed"] = {kPunctual, "EXT_lights_ies"};
  b.root["extensions"][kPunctual]["lights"] = {
      {{"type", "directional"}, {"name", "Sun"}},
      {{"type", "point"}, {"name", "Bulb"}, {"intensity", 3}},
      {{"type", "point"}, {"name", "Off"}, {"extras", {{"kiln", {{"bake", "none"}}}}}}};
  b.node(lamp("sun", 0));
  json bulb = lamp("bulb", 1);
  bulb["extras"]["kiln"]["bake"] = "indirect";
  b.node(bulb);
  b.node(lamp("off", 2));
  b.node(
      {{"name", "panel"},
       {"extras",
        {{"mine", 1}, {"kiln", {{"light", {{"shape", "disc"}, {"radius", 1}, {"radiance", {1, 1, 1}}}}}}}}});
  json pendant = lamp("pendant", 0);
  pendant["mesh"] = plain;
  b.node(pendant);
  const Bytes profile(reinterpret_cast<const std::byte*>(kIesFile),
                      reinterpret_cast<const std::byte*>(kIesFile) + sizeof kIesFile - 1);
  b.root["extensions"]["EXT_lights_ies"]["lights"] = {
      {{"bufferView", b.view_of(profile)}, {"mimeType", "application/x-ies-lm-63"}}};
  b.node({{"name", "downlight"}, {"extensions", {{"EXT_lights_ies", {{"light", 0}}}}}});
  if (skyless) return b;
  b.root["extensionsUsed"].push_back("EXT_lights_image_based");
  json faces = json::array();
  for (int k = 0; k < 6; ++k) {
    b.image(test::small_png(100, 100, 100));
    faces.push_back(b.root["images"].size() - 1);
  }
  b.root["extensions"]["EXT_lights_image_based"]["lights"] = {
      {{"intensity", 1}, {"specularImages", {faces}}, {"irradianceCoefficients", json::array()}}};
  b.root["scenes"][0]["extensions"]["EXT_lights_image_based"]["light"] = 0;
  return b;
}

class Lamps : public testing::Test {
 protected:
  json write(const test::GltfBuilder& builder, const BakeSettings& settings,
             const std::string& file = "scene.glb") {
    auto imported = import_scene(test::write_glb_file(builder, dir_.path()), settings);
    EXPECT_TRUE(imported) << (imported ? "" : imported.error().message);
    if (!imported) return {};
    AtlasSettings layout;
    layout.layout = AtlasSettings::Layout::kPack;
    const Atlas atlas = *build_atlas(imported->scene, layout);
    Lightmap map;
    map.page_height = atlas.height;
    map.planes.width = atlas.width;
    map.planes.height = atlas.height * atlas.pages;
    for (const char* name : {"E.R", "E.G", "E.B", "error", "samples"})
      map.planes.add(name).assign(atlas.owner.size(), 1.0f);
    map.validity.assign(atlas.owner.size(), Validity::kMeasured);
    map.has_light = settings.quantities.light;
    const Projection projection;
    const OutputContext context{settings,    imported->scene,    atlas,      imported->document, map,
                                dir_.path(), &imported->display, &projection};
    lamps_ = choose_lamps(context).in_map.size();
    const auto written = file == "scene.glb" ? write_gltf(context) : write_gltf_unlit(context);
    EXPECT_TRUE(written) << (written ? "" : written.error().message);
    const Bytes glb = *read_file(dir_.path() / file);
    uint32_t length = 0;
    std::memcpy(&length, &glb[12], 4);
    const char* text = reinterpret_cast<const char*>(&glb[20]);
    return json::parse(text, text + length);
  }
  static BakeSettings with(const char* lamps) {
    BakeSettings s;
    s.basis = "irradiance";
    s.lamps = lamps;
    return s;
  }

  test::TempDir dir_;
  size_t lamps_ = 0;  // in the map
};

json node(const json& doc, const std::string& name) {
  for (const json& n : doc["nodes"])
    if (n.value("name", "") == name) return n;
  return {};
}

// The name of the light of KHR_lights_punctual that a node names; empty: none.
std::string light_of(const json& doc, const std::string& name) {
  const json n = node(doc, name);
  if (!n.contains("extensions") || !n["extensions"].contains(kPunctual)) return "";
  return doc["extensions"][kPunctual]["lights"].at(n["extensions"][kPunctual]["light"].get<size_t>())["name"];
}

bool uses(const json& doc, const char* extension) {
  const json used = doc.value("extensionsUsed", json::array());
  return std::find(used.begin(), used.end(), extension) != used.end();
}

const json& description(const json& doc) {
  return doc["extensions"]["KILN_lightmap"]["lightmaps"][0]["lamps"];
}

TEST_F(Lamps, ThoseInTheMapAreLeftOut) {
  const json doc = write(scene_of_lamps(), with("drop"));
  EXPECT_EQ(lamps_, 4u);
  EXPECT_EQ(light_of(doc, "sun"), "");
  EXPECT_EQ(light_of(doc, "pendant"), "");
  EXPECT_TRUE(node(doc, "pendant").contains("mesh"));
  EXPECT_EQ(light_of(doc, "bulb"), "Bulb") << "its direct light is not in the map";
  EXPECT_EQ(light_of(doc, "off"), "Off");
  EXPECT_EQ(doc["extensions"][kPunctual]["lights"].size(), 2u) << "nothing names the sun any more";
  EXPECT_TRUE(uses(doc, kPunctual));
  EXPECT_FALSE(uses(doc, "EXT_lights_ies"));
  EXPECT_FALSE(doc["extensions"].contains("EXT_lights_ies"));
  EXPECT_FALSE(uses(doc, "EXT_lights_image_based"));
  EXPECT_FALSE(doc["scenes"][0].contains("extensions"));
  EXPECT_EQ(node(doc, "panel")["extras"], (json{{"mine", 1}}));
  EXPECT_EQ(description(doc), (json{{"mode", "drop"}}));
}

TEST_F(Lamps, WithoutOthersTheExtensionGoes) {
  test::GltfBuilder b = test::small_scene();
  const json doc = write(b, with("drop"));
  EXPECT_FALSE(uses(doc, kPunctual));
  EXPECT_FALSE(doc["extensions"].contains(kPunctual));
}

TEST_F(Lamps, KeptTheyAreListed) {
  const json doc = write(scene_of_lamps(), with("keep"));
  for (const auto& [name, light] :
       {std::pair("sun", "Sun"), {"bulb", "Bulb"}, {"off", "Off"}, {"pendant", "Sun"}})
    EXPECT_EQ(light_of(doc, name), light);
  EXPECT_TRUE(uses(doc, "EXT_lights_ies") && uses(doc, "EXT_lights_image_based"));
  std::set<std::string> listed;
  for (const json& n : description(doc)["nodes"]) listed.insert(doc["nodes"][n.get<size_t>()]["name"]);
  EXPECT_EQ(listed, (std::set<std::string>{"sun", "panel", "pendant", "downlight"}));
  EXPECT_EQ(doc.dump().find("\"baked\""), std::string::npos);
}

TEST_F(Lamps, MarkedTheySaySo) {
  test::GltfBuilder b = scene_of_lamps();
  for (json& n : b.root["nodes"])
    if (n["name"] == "off") n["extras"]["kiln"]["baked"] = true;  // of an earlier bake
  const json doc = write(b, with("mark"));
  for (const char* name : {"sun", "panel", "pendant", "downlight"})
    EXPECT_EQ(node(doc, name)["extras"]["kiln"]["baked"], true) << name;
  for (const char* name : {"bulb", "off", "floor"})
    EXPECT_FALSE(
        node(doc, name).value("extras", json::object()).value("kiln", json::object()).contains("baked"))
        << name;
  EXPECT_EQ(doc["scenes"][0]["extras"]["kiln"]["baked"], true) << "the image-based light";
  EXPECT_EQ(light_of(doc, "sun"), "Sun");
}

TEST_F(Lamps, AMapWithoutDirectLightHasNone) {
  BakeSettings s = with("drop");
  s.direct = false;
  json doc = write(scene_of_lamps(), s);
  EXPECT_EQ(light_of(doc, "sun"), "Sun");
  EXPECT_EQ(description(doc), (json{{"mode", "keep"}}));
  s = with("drop");
  s.quantities = *parse_quantities("ao");
  s.gltf_lightmap.moz = false;
  EXPECT_TRUE(choose_lamps({s, {}, {}, {}, {}, {}}).in_map.empty());
}

// A pointer of an animation names a light by its number.
TEST_F(Lamps, NumbersStayWherePointersNameThem) {
  test::GltfBuilder b = scene_of_lamps();
  b.root["extensionsUsed"].push_back("KHR_animation_pointer");
  const json doc = write(b, with("drop"));
  EXPECT_EQ(light_of(doc, "sun"), "");
  EXPECT_EQ(doc["extensions"][kPunctual]["lights"].size(), 3u);
  EXPECT_EQ(light_of(doc, "bulb"), "Bulb");
}

TEST_F(Lamps, TheUnlitSceneHasNone) {
  test::GltfBuilder b = scene_of_lamps();
  const int image = b.image(test::small_png(200, 10, 10));
  b.textured_triangle({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", image}}}}},
                       {"extensions", {{"KHR_materials_ior", {{"ior", 1.4}}}}}});
  b.root["nodes"].back()["extras"]["kiln"]["receive"] = false;
  b.root["extensionsUsed"].push_back("KHR_materials_ior");
  const json doc = write(b, with("keep"), "scene_unlit.glb");
  for (const char* extension : {kPunctual, "EXT_lights_ies", "EXT_lights_image_based", "KHR_materials_ior"}) {
    EXPECT_FALSE(uses(doc, extension)) << extension;
    EXPECT_EQ(doc.dump().find(extension), std::string::npos) << extension;
  }
  EXPECT_EQ(node(doc, "panel")["extras"], (json{{"mine", 1}}));
  EXPECT_EQ(doc["materials"].size(), 2u) << "lit, and of the object without texels";
  for (const json& material : doc["materials"])
    EXPECT_TRUE(material["extensions"].contains("KHR_materials_unlit"));
  EXPECT_EQ(doc["images"].size(), 2u) << "the page and the texture; the sky's six are gone";
  EXPECT_EQ(doc["textures"].size(), 2u);
}

// 0.5 in a light of E = 1, at the exposure of the file, through the curve.
TEST_F(Lamps, ObjectsWithoutTexelsAreUnlitInTheMedianLight) {
  test::GltfBuilder b = test::small_scene();
  b.textured_triangle({{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 0.5, 1.0}}}}});
  b.root["nodes"].back()["extras"]["kiln"]["receive"] = false;
  const json doc = write(b, with("drop"), "scene_unlit.glb");
  const double exposed = doc["extras"]["kiln"]["exposure"].get<double>() * 0.5 / 3.14159265358979;
  // Narkowicz 2015.
  const double shown = exposed * (2.51 * exposed + 0.03) / (exposed * (2.43 * exposed + 0.59) + 0.14);
  bool found = false;
  for (const json& material : doc["materials"]) {
    if (!material["pbrMetallicRoughness"].contains("baseColorFactor")) continue;
    found = true;
    for (size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(material["pbrMetallicRoughness"]["baseColorFactor"][k].get<double>(), shown, 1e-5);
  }
  EXPECT_TRUE(found);
}

TEST_F(Lamps, FilesSayWhichProgramWroteThem) {
  for (const char* file : {"scene.glb", "scene_unlit.glb"}) {
    const json doc = write(test::small_scene(), with("drop"), file);
    EXPECT_EQ(doc["asset"]["generator"], program_name());
  }
  EXPECT_TRUE(program_name().starts_with("Kiln ") && std::isdigit(program_name()[5])) << program_name();
}

}  // namespace
}  // namespace kiln
