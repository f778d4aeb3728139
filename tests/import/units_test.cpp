// Lamps that Blender wrote in lumens, and files whose textures are compressed in a way that is not read.
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::note_with;
using test::says;

constexpr const char* kBlender = "Khronos glTF Blender I/O v4.0.44";
constexpr const char* kWarned = "683";

// A triangle that emits if asked, and a lamp.
GltfBuilder lit(const char* type, double intensity, bool emits, const char* generator = kBlender) {
  GltfBuilder b = test::small_scene();
  b.root["asset"]["generator"] = generator;
  b.root["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"name", "Lamp"}, {"type", type}, {"intensity", intensity}}};
  const int material = b.material({{"name", "ceiling"}, {"emissiveFactor", {1, 1, 1}}});
  if (emits) b.root["meshes"][0]["primitives"][0]["material"] = material;
  return b;
}

TEST(BlenderUnits, ASunInLuxBesideEmissionIsNamedWithItsFactor) {
  const ImportResult r = imported(lit("directional", 2732, true));
  const std::string note = note_with(r, kWarned);
  EXPECT_TRUE(says(note, "'ceiling'")) << test::all_notes(r);
  EXPECT_TRUE(says(note, "'Lamp' has 2732 lux, 4 W/m2 times 683"));
  EXPECT_TRUE(says(note, "Unitless"));
}

TEST(BlenderUnits, ALampInCandelaToo) {
  const ImportResult r = imported(lit("point", 5435.1413, true));
  EXPECT_TRUE(says(note_with(r, kWarned), "100 W times 683 / (4 pi)")) << test::all_notes(r);
}

TEST(BlenderUnits, AnEnvironmentIsReasonEnough) {
  BakeSettings settings;
  settings.environment = "1,1,1";
  EXPECT_TRUE(
      says(note_with(imported(lit("directional", 2732, false), settings), kWarned), "the environment"));
}

TEST(BlenderUnits, NothingIsSaidWithoutReason) {
  EXPECT_EQ(note_with(imported(lit("directional", 2732, false)), kWarned), "") << "nothing else shines";
  EXPECT_EQ(note_with(imported(lit("directional", 4, true)), kWarned), "") << "exported without units";
  EXPECT_EQ(note_with(imported(lit("point", 80, true)), kWarned), "");
  EXPECT_EQ(note_with(imported(lit("directional", 1000, true, "another program")), kWarned), "");
  EXPECT_NE(note_with(imported(lit("directional", 2049, true, "another program")), kWarned), "")
      << "three times 683, by way of a program that writes its own name";
}

TEST(Compression, IsRefusedWithTheCommandThatTakesItAway) {
  GltfBuilder b = test::small_scene();
  b.root["extensionsUsed"] = {"KHR_texture_basisu"};
  b.root["extensionsRequired"] = {"KHR_texture_basisu"};
  const std::string message = test::refused(b);
  EXPECT_TRUE(says(message, "it requires KHR_texture_basisu")) << message;
  EXPECT_TRUE(says(message, "`npx @gltf-transform/cli ktxdecompress x.glb out.glb`")) << message;
}

}  // namespace
}  // namespace kiln
