#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;
using test::refused;

Record only_material(const json& material) {
  GltfBuilder b;
  b.textured_triangle(material);
  const Scene scene = imported(b).scene;
  EXPECT_EQ(scene.materials.size(), 1u);
  return scene.materials.empty() ? Record{} : scene.materials[0];
}

std::vector<double> numbers(const Record& record, const char* name) {
  const Property* p = record.find(name);
  return p ? p->numbers : std::vector<double>{};
}
using N = std::vector<double>;

TEST(Materials, AllFactors) {
  const Record m = only_material(json::parse(R"({"name": "paint", "alphaMode": "MASK", "alphaCutoff": 0.25,
    "doubleSided": true, "emissiveFactor": [1, 0.5, 0], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 40}},
    "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.75}})"));
  EXPECT_EQ(m.type, "metallic_roughness");
  EXPECT_EQ(m.name, "paint");
  EXPECT_EQ(numbers(m, "base_color"), (N{0.1, 0.2, 0.3, 0.4}));
  EXPECT_EQ(numbers(m, "metallic"), (N{0.5}));
  EXPECT_EQ(numbers(m, "roughness"), (N{0.75}));
  EXPECT_EQ(numbers(m, "emission"), (N{40, 20, 0}));
  EXPECT_EQ(numbers(m, "alpha_cutoff"), (N{0.25}));
  EXPECT_EQ(numbers(m, "double_sided"), (N{1}));
  EXPECT_EQ(m.find("alpha_mode")->word, "mask");
}

// --materials diffuse reads what its material has, and no texture that it does not need.
TEST(Materials, DiffuseKeepsBaseColourMetalAlphaAndEmission) {
  GltfBuilder b;
  ASSERT_EQ(b.image(test::small_png(128, 128, 255)), 0);
  b.textured_triangle(json::parse(R"({"name": "paint", "alphaMode": "BLEND", "emissiveFactor": [1, 0, 0],
    "normalTexture": {"index": 0},
    "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.75},
    "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.25},
                   "KHR_materials_clearcoat": {"clearcoatFactor": 1},
                   "KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1]}}})"));
  BakeSettings settings;
  settings.materials = "diffuse";
  const ImportResult r = imported(b, settings);
  const Record& m = r.scene.materials.at(0);
  EXPECT_EQ(m.type, "diffuse");
  EXPECT_EQ(numbers(m, "base_color"), (N{0.1, 0.2, 0.3, 0.4}));
  EXPECT_EQ(numbers(m, "metallic"), (N{0.5}));
  EXPECT_EQ(numbers(m, "transmission"), (N{0.25}));
  EXPECT_EQ(numbers(m, "emission"), (N{1, 0, 0}));
  EXPECT_EQ(m.find("alpha_mode")->word, "blend");
  for (const char* name : {"roughness", "normal_texture", "clearcoat", "sheen_color", "specular"})
    EXPECT_EQ(m.find(name), nullptr) << name;
  EXPECT_TRUE(r.scene.textures.empty());
  EXPECT_EQ(imported(b).scene.textures.size(), 1u) << "the normal map";
}

TEST(Materials, DiffuseNamesMetalThatTurnsBlack) {
  GltfBuilder b;
  b.textured_triangle(json::parse(R"({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1]}})"));
  BakeSettings settings;
  settings.materials = "diffuse";
  EXPECT_SAYS(test::all_notes(imported(b, settings)), "metal reflects nothing with --materials diffuse");
}

TEST(Materials, DefaultsOfGltf) {
  GltfBuilder b;
  b.node({{"mesh", b.triangle()}});
  for (const Record& m : {only_material(json::object()), imported(b).scene.materials.at(0)}) {
    EXPECT_EQ(numbers(m, "base_color"), (N{1, 1, 1, 1}));
    EXPECT_EQ(numbers(m, "metallic"), (N{1}));
    EXPECT_EQ(numbers(m, "roughness"), (N{1}));
    EXPECT_EQ(numbers(m, "emission"), (N{0, 0, 0}));
    EXPECT_EQ(numbers(m, "double_sided"), (N{0}));
    EXPECT_EQ(m.find("alpha_mode")->word, "opaque");
  }
}

TEST(Materials, OnlyUsedOnesAreKept) {
  GltfBuilder b;
  b.material({{"name", "unused"}});
  b.textured_triangle({{"name", "used"}});
  b.node({{"mesh", b.triangle()}});
  const Scene scene = imported(b).scene;
  ASSERT_EQ(scene.materials.size(), 2u);
  EXPECT_EQ(scene.materials[0].name, "used");
  EXPECT_EQ(scene.materials[1].name, "default");
  EXPECT_EQ(scene.instances[0].material, 0u);
  EXPECT_EQ(scene.instances[1].material, 1u);
}

TEST(Materials, Unlit) {
  const Record m = only_material(json::parse(R"({"emissiveFactor": [1, 1, 1],
    "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0, 0, 1]}, "extensions": {"KHR_materials_unlit": {}}})"));
  EXPECT_EQ(m.type, "unlit");
  EXPECT_EQ(numbers(m, "base_color"), (N{0.5, 0, 0, 1}));
  EXPECT_FALSE(m.find("emission"));
  EXPECT_FALSE(m.find("roughness"));
}

TEST(Materials, LayersOfTheExtensions) {
  GltfBuilder b;
  b.root["extensionsUsed"] =
      b.root["extensionsRequired"] = {"KHR_materials_transmission", "KHR_materials_ior"};
  const int t = b.image(test::small_png(7, 8, 9));
  json m = json::parse(R"({"extensions": {
    "KHR_materials_transmission": {"transmissionFactor": 0.9, "transmissionTexture": {"index": 0}},
    "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0.25]},
    "KHR_materials_ior": {"ior": 1.45},
    "KHR_materials_specular": {"specularFactor": 0.5, "specularTexture": {"index": 0}, "specularColorFactor": [2, 1, 0]},
    "KHR_materials_sheen": {"sheenColorFactor": [0.1, 0.2, 0.3], "sheenRoughnessFactor": 0.5},
    "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25,
                                "clearcoatTexture": {"index": 0}}}})");
  ASSERT_EQ(t, 0);
  b.textured_triangle(m);
  const ImportResult r = imported(b);
  const Record& record = r.scene.materials.at(0);
  EXPECT_EQ(numbers(record, "transmission"), (N{0.9}));
  EXPECT_EQ(numbers(record, "ior"), (N{1.45}));
  EXPECT_EQ(numbers(record, "specular"), (N{0.5}));
  EXPECT_EQ(numbers(record, "specular_color"), (N{2, 1, 0}));
  EXPECT_EQ(numbers(record, "sheen_color"), (N{0.1, 0.2, 0.3}));
  EXPECT_EQ(numbers(record, "sheen_roughness"), (N{0.5}));
  EXPECT_EQ(numbers(record, "clearcoat"), (N{0.5}));
  EXPECT_EQ(numbers(record, "clearcoat_roughness"), (N{0.25}));
  // Half is left after 2 m: ln 2 / 2 a metre; a quarter: twice that.
  const N absorption = numbers(record, "absorption");
  ASSERT_EQ(absorption.size(), 3u);
  EXPECT_NEAR(absorption[0], 0, 1e-12);
  EXPECT_NEAR(absorption[1], 0.34657359, 1e-7);
  EXPECT_NEAR(absorption[2], 0.69314718, 1e-7);
  // One linear texture of three channels, one of alpha alone.
  ASSERT_EQ(r.scene.textures.size(), 2u);
  const auto texture = [&](const char* name) {
    return r.scene.textures.at(static_cast<size_t>(record.find(name)->texture.texture));
  };
  EXPECT_EQ(texture("transmission_texture").texels.at(0), std::byte{7});
  EXPECT_EQ(texture("clearcoat_texture").channels, 3u);
  EXPECT_EQ(texture("specular_texture").channels, 1u);
  EXPECT_EQ(texture("specular_texture").texels.at(0), std::byte{255}) << "the file has no alpha";
  EXPECT_SAYS(test::note_with(r, "KHR_materials_transmission"), "no refraction");
}

TEST(Materials, ThinGlassAbsorbsNothingAndBadNumbersAreSaid) {
  GltfBuilder b;
  b.textured_triangle(json::parse(R"({"extensions": {
    "KHR_materials_transmission": {"transmissionFactor": 3},
    "KHR_materials_volume": {"attenuationDistance": 2, "attenuationColor": [1, 0.5, 0.25]},
    "KHR_materials_ior": {"ior": 0.5}}})"));
  b.textured_triangle(json::parse(R"({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
    "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": -2, "attenuationColor": [0, 0, 0]}}})"));
  const ImportResult r = imported(b);
  EXPECT_FALSE(r.scene.materials.at(0).find("absorption"));
  EXPECT_FALSE(r.scene.materials.at(1).find("absorption"));
  EXPECT_EQ(numbers(r.scene.materials[0], "transmission"), (N{1}));
  EXPECT_EQ(numbers(r.scene.materials[0], "ior"), (N{1}));
  EXPECT_SAYS(test::all_notes(r), "ior 0.5 is outside of 1 to");
  EXPECT_SAYS(test::all_notes(r), "attenuationDistance -2 is not a valid distance");
}

TEST(Materials, SpecularGlossinessBecomesADielectric) {
  const Record m = only_material(json::parse(R"({"extensions": {"KHR_materials_pbrSpecularGlossiness":
    {"diffuseFactor": [0.5, 0.25, 0.125, 1], "glossinessFactor": 0.25}}})"));
  EXPECT_EQ(numbers(m, "base_color"), (N{0.5, 0.25, 0.125, 1}));
  EXPECT_EQ(numbers(m, "metallic"), (N{0}));
  EXPECT_EQ(numbers(m, "roughness"), (N{0.75}));
}

TEST(Materials, FactorsOutsideOfTheirRangeAreClamped) {
  GltfBuilder b;
  b.textured_triangle(
      json::parse(R"({"pbrMetallicRoughness": {"baseColorFactor": [2, -1, 0, 1], "roughnessFactor": 7},
    "emissiveFactor": [-1, 1, 0]})"));
  const ImportResult r = imported(b);
  EXPECT_EQ(numbers(r.scene.materials.at(0), "base_color"), (N{1, 0, 0, 1}));
  EXPECT_EQ(numbers(r.scene.materials[0], "roughness"), (N{1}));
  EXPECT_EQ(numbers(r.scene.materials[0], "emission"), (N{0, 1, 0}));
  EXPECT_SAYS(test::all_notes(r), "material 0: roughnessFactor 7 is outside of 0 to 1 and clamped");
  EXPECT_SAYS(test::all_notes(r), "material 0: its emission -1 is not a valid radiance: taken as 0");
}

TEST(Extensions, RequiredOnesThatAreNotSupportedAreAnError) {
  GltfBuilder b = test::small_scene();
  b.root["extensionsRequired"] = {"KHR_lights_punctual", "XX_never_heard", "XX_unheard_of"};
  EXPECT_SAYS(refused(b), "x.glb: it requires what is not supported: XX_never_heard, XX_unheard_of");
  b.root["extensionsUsed"] = b.root["extensionsRequired"];
  b.root.erase("extensionsRequired");
  EXPECT_SAYS(test::all_notes(imported(b)), "XX_unheard_of: not supported; the file does not require it");
}

}  // namespace
}  // namespace kiln
