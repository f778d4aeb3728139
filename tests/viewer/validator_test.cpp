// Khronos' validator on what encode writes: the demo, scenes made by others, and files in odd shapes.
#include "coordinator/run/bake_run.h"
#include "tests/import/gltf_builder.h"
#include "tests/viewer/node_tools.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

// Bakes with two samples a texel and validates every .glb that comes out. Its coordinates and images are what
// is looked at, not its light. `probe_objects`: how many of KILN_probes there are in scene.glb.
void expect_valid(const fs::path& scene, BakeSettings settings, int probe_objects = 0) {
  test::TempDir dir;
  BakeRequest r;
  r.scene = scene;
  r.output = dir.path() / "out";
  r.worker_program = test::binary_dir() / "bin/kiln-worker";
  r.settings = std::move(settings);
  r.settings.min_samples = r.settings.max_samples = 2;
  r.settings.max_bounces = 1;
  r.settings.gltf_lightmap = {true, true, true, true};
  r.settings.instanced = r.settings.embed_basecolor = true;
  r.settings.seams = false;
  r.settings.encodings.clear();
  const auto report = run_bake(r, [](const BakeProgress&) {});
  ASSERT_TRUE(report) << report.error().message;
  const auto said =
      test::run_command(test::node_script("validate.mjs") + " '" + r.output.string() + "'/*.glb");
  EXPECT_EQ(said.exit_status, 0) << said.output;
  const char* const last = wants_lightmap(r.settings) ? "scene_unlit.glb: 0 errors" : "scene.glb: 0 errors";
  EXPECT_NE(said.output.find(last), std::string::npos) << said.output;
  const auto schema = test::run_command(test::node_script("schema.mjs") + " '" +
                                        (test::source_dir() / "docs/schema").string() + "' '" +
                                        r.output.string() + "'/scene*.glb");
  EXPECT_EQ(schema.exit_status, 0) << schema.output;
  EXPECT_NE(schema.output.find(std::to_string(probe_objects) + " of probes"), std::string::npos)
      << schema.output;
  EXPECT_EQ(schema.output.find("scene.glb: 0 objects") == std::string::npos, wants_lightmap(r.settings))
      << schema.output;
}

BakeSettings packed(double density, uint32_t page = 8192) {
  BakeSettings s;
  s.layout = "pack";
  s.texels_per_metre = density;
  s.page_size = page;
  s.environment = "1,1,1";
  return s;
}

TEST(Validator, FindsNoErrorInTheDemo) {
  if (const auto why = test::no_node_tools(false)) GTEST_SKIP() << *why;
  expect_valid(test::source_dir() / "tests/scenes/arcade/arcade.gltf", packed(1));
}

TEST(Validator, FindsNoErrorOnSeveralPages) {
  if (const auto why = test::no_node_tools(false)) GTEST_SKIP() << *why;
  expect_valid(test::source_dir() / "tests/scenes/arcade/arcade.gltf", packed(1, 128));
}

class SharedScenes : public testing::TestWithParam<const char*> {};
TEST_P(SharedScenes, HaveNoErrorFound) {
  if (const auto why = test::no_node_tools(false)) GTEST_SKIP() << *why;
  const auto path = test::shared_scene(GetParam());
  if (!path) GTEST_SKIP() << GetParam() << " is not beside the checkout (or in $KILN_SCENES)";
  expect_valid(*path, packed(0.5));
}
INSTANTIATE_TEST_SUITE_P(Validator, SharedScenes,
                         testing::Values("godot_room.glb", "MixedLightingExample.glb", "veach-bidir.glb"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace_if(
                               name.begin(), name.end(), [](char c) { return !std::isalnum(c); }, '_');
                           return name;
                         });

// A strip, a sparse accessor, quantised positions, instancing, a level of detail, coordinates only in set 1
// and a texture that uses them, an accessor and a mesh that nothing needs.
test::GltfBuilder odd_shapes() {
  using test::json;
  test::GltfBuilder b;
  const std::vector<float> square{0, 0, 0, 0, 0, 2, 2, 0, 0, 2, 0, 2};
  const int strip = b.vec3(square), corners = b.vec2({0, 0, 0, 1, 1, 0, 1, 1});
  const int image = b.image(test::small_png(200, 100, 50));
  const int painted =
      b.material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", image}, {"texCoord", 1}}}}}});
  b.mesh(
      {{"attributes", {{"POSITION", strip}, {"TEXCOORD_1", corners}}}, {"mode", 5}, {"material", painted}});
  const int moved = b.vec3(square);
  b.root["accessors"][moved]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", b.view(std::vector<uint16_t>{3, 0})}, {"componentType", 5123}}},
      {"values", {{"bufferView", b.view(std::vector<float>{2, 1, 2})}}}};
  b.root["accessors"][moved]["sparse"]["indices"].erase("byteOffset");
  b.mesh({{"attributes", {{"POSITION", moved}}}, {"mode", 5}});
  const std::vector<int16_t> whole{0, 0, 0, 0, 0, 0, 2, 0, 2, 0, 0, 0, 2, 0, 2, 0};
  const int quantised = b.accessor(b.view(whole, 8), 5122, 4, "VEC3");
  b.mesh({{"attributes", {{"POSITION", quantised}}}, {"mode", 5}});
  b.root["extensionsUsed"] = {"KHR_mesh_quantization", "EXT_mesh_gpu_instancing", "MSFT_lod"};
  b.root["extensionsRequired"] = {"KHR_mesh_quantization"};
  b.node({{"mesh", 0}, {"name", "strip"}});
  b.node({{"mesh", 1}, {"name", "sparse"}, {"translation", {10, 0, 0}}});
  b.node({{"mesh", 2}, {"name", "quantised"}, {"translation", {20, 0, 0}}});
  b.node({{"mesh", 2},
          {"name", "repeated"},
          {"translation", {0, 0, 10}},
          {"extensions",
           {{"EXT_mesh_gpu_instancing",
             {{"attributes", {{"TRANSLATION", b.vec3({0, 0, 0, 5, 0, 0, 10, 0, 0})}}}}}}}});
  b.root["nodes"].push_back({{"mesh", 0}, {"name", "far"}, {"translation", {0, 0, 20}}});
  const size_t far = b.root["nodes"].size() - 1;
  b.node({{"mesh", 0},
          {"name", "near"},
          {"translation", {0, 0, 20}},
          {"extensions", {{"MSFT_lod", {{"ids", {far}}}}}}});
  b.vec3({1, 2, 3});
  return b;
}

TEST(Validator, FindsNoErrorInOddShapes) {
  if (const auto why = test::no_node_tools(false)) GTEST_SKIP() << *why;
  test::TempDir dir;
  expect_valid(test::write_glb_file(odd_shapes(), dir.path()), packed(4));
  expect_valid(test::write_glb_file(odd_shapes(), dir.path()), packed(4, 32));
}

// Volumes that nodes ask for, one a child and turned, and one that no node asks for.
TEST(Validator, FindsNoErrorWithProbes) {
  if (const auto why = test::no_node_tools(false)) GTEST_SKIP() << *why;
  test::TempDir dir;
  test::GltfBuilder b = odd_shapes();
  const auto probes = [](double low, double high) {
    return test::json{{"kiln", {{"probes", {{"min", {low, low, low}}, {"max", {high, high, high}}}}}}};
  };
  b.node({{"mesh", 0}, {"name", "lit hall"}, {"translation", {0, 0, 40}}, {"extras", probes(-1, 2)}});
  b.root["nodes"].push_back({{"name", "turned"}, {"rotation", {0, 0.6, 0, 0.8}}, {"extras", probes(0, 3)}});
  b.node({{"name", "parent"}, {"children", {b.root["nodes"].size() - 1}}});
  const fs::path scene = test::write_glb_file(b, dir.path());
  BakeSettings settings = packed(4);
  ASSERT_TRUE(set_option(settings, "probe-files", "bevy", "test"));
  expect_valid(scene, settings, 3);
  settings.probes = "auto";
  settings.probe_spacing = settings.probe_max_spacing = 4;
  settings.probe_visibility = true;
  expect_valid(scene, settings, 2);
  ASSERT_TRUE(set_option(settings, "quantities", "probes", "test"));
  expect_valid(scene, settings, 2);
}

TEST(Validator, FindsNoErrorInScenesThatWereCompressed) {
  if (const auto why = test::no_node_tools(false)) GTEST_SKIP() << *why;
  for (const char* name : {"triangles", "quantized", "filters", "draco", "webp", "avif"}) {
    SCOPED_TRACE(name);
    expect_valid(test::source_dir() / "tests/import/compressed" / (std::string(name) + ".glb"), packed(0.5));
  }
}

}  // namespace
}  // namespace kiln
