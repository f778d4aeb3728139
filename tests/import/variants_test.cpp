// KHR_materials_variants: which materials are baked.
#include "coordinator/scene/document/gltf_document.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;
using test::refused;

// Two triangles: the first has a material in every variant, the second in none.
GltfBuilder shoes() {
  GltfBuilder b;
  const int triangle = b.triangle();
  b.root["meshes"].push_back(b.root["meshes"][0]);
  for (const char* name : {"grey", "red", "blue"}) b.material({{"name", name}});
  for (int mesh = triangle; mesh < triangle + 2; ++mesh) {
    b.root["meshes"][mesh]["primitives"][0]["material"] = 0;
    b.node({{"mesh", mesh}});
  }
  b.root["extensionsUsed"] = {"KHR_materials_variants"};
  b.root["extensions"]["KHR_materials_variants"]["variants"] =
      json::parse(R"([{"name": "day"}, {"name": "night"}, {"name": "bare"}])");
  b.root["meshes"][triangle]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] =
      json::parse(R"([{"material": 1, "variants": [0]}, {"material": 2, "variants": [2, 1]}])");
  return b;
}

std::vector<std::string> materials_of(const ImportResult& result) {
  std::vector<std::string> names;
  for (const Instance& i : result.scene.instances) names.push_back(result.scene.materials[i.material].name);
  return names;
}

ImportResult baked(const std::string& variant) {
  BakeSettings settings;
  settings.variant = variant;
  return imported(shoes(), settings);
}

std::string error_of(const GltfBuilder& b, const std::string& variant) {
  BakeSettings settings;
  settings.variant = variant;
  return refused(b, settings);
}

TEST(Variants, TheFilesOwnMaterialsAreTheDefaultAndOthersAreNamed) {
  const ImportResult result = imported(shoes());
  EXPECT_EQ(materials_of(result), (std::vector<std::string>{"grey", "grey"}));
  bool named = false;
  for (const ImportNote& note : result.notes)
    named |= note.what.find("'day', 'night', 'bare'") != std::string::npos;
  EXPECT_TRUE(named);
}

TEST(Variants, OneOfThemIsBakedAndShownByTheFileThatIsWritten) {
  EXPECT_EQ(materials_of(baked("day")), (std::vector<std::string>{"red", "grey"}));
  EXPECT_EQ(materials_of(baked("bare")), (std::vector<std::string>{"blue", "grey"}));
  const ImportResult night = baked("night");
  EXPECT_EQ(materials_of(night), (std::vector<std::string>{"blue", "grey"}));
  const json written = json::parse(night.document.json);
  EXPECT_EQ(written["meshes"][0]["primitives"][0]["material"], 2);
  EXPECT_TRUE(written["meshes"][0]["primitives"][0]["extensions"].contains("KHR_materials_variants"));
}

TEST(Variants, UnknownOnesAndDamageAreRefusedByName) {
  EXPECT_NE(error_of(shoes(), "dusk")
                .find("--variant dusk: there is no such variant, there are 'day', 'night', 'bare'"),
            std::string::npos);
  EXPECT_NE(error_of(test::small_scene(), "day").find("the file has no material variants"),
            std::string::npos);
  const auto damaged = [](const char* mappings) {
    GltfBuilder b = shoes();
    b.root["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] =
        json::parse(mappings);
    return error_of(b, "night");
  };
  for (const char* mappings :
       {"[7]", "[{}]", R"([{"material": 1}])", R"([{"material": -1, "variants": [1]}])",
        R"([{"material": 1, "variants": {"1": 1}}])", R"([{"material": "red", "variants": [1]}])"})
    EXPECT_NE(damaged(mappings).find("mesh 0 primitive 0: a mapping of KHR_materials_variants"),
              std::string::npos)
        << mappings;
  EXPECT_NE(damaged(R"([{"material": 99, "variants": [1]}])").find("material 99 does not exist"),
            std::string::npos);
  EXPECT_NE(damaged(R"([{"material": 9999999999, "variants": [1]}])").find("there is no material 9999999999"),
            std::string::npos);
  for (const char* variants : {"7", "[7]", R"([{"name": 7}])", "[{}]"}) {
    GltfBuilder b = shoes();
    b.root["extensions"]["KHR_materials_variants"]["variants"] = json::parse(variants);
    EXPECT_NE(error_of(b, "day").find("--variant day"), std::string::npos) << variants;
    imported(b);  // nobody asked for a variant
  }
}

}  // namespace
}  // namespace kiln
