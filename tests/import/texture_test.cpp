#include <cstring>

#include "common/base/files.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;

json base_color(int texture) {
  return {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}};
}

// 2x1 RGBA PNG: (200, 100, 50, 128), (1, 2, 3, 255).
const std::vector<uint8_t> kRgbaPng = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44,
    0x52, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0x08, 0x06, 0x00, 0x00, 0x00, 0xf4,
    0x22, 0x7f, 0x8a, 0x00, 0x00, 0x00, 0x11, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0x38,
    0x91, 0x62, 0xd4, 0xc0, 0xc8, 0xc4, 0xfc, 0x1f, 0x00, 0x0d, 0xc0, 0x02, 0xe4, 0xb5, 0xb6,
    0x15, 0xc3, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

TEST(Textures, ColoursAreSrgbFactorsAreLinear) {
  GltfBuilder b;
  const int colour = b.image(test::small_png(10, 20, 30)), factors = b.image(test::small_png(0, 128, 255));
  json m = base_color(colour);
  m["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", factors}};
  m["emissiveTexture"] = {{"index", colour}};
  m["emissiveFactor"] = {1, 1, 1};
  b.textured_triangle(m);
  const Scene scene = imported(b).scene;
  ASSERT_EQ(scene.textures.size(), 2u) << "the colour is decoded once";
  const Record& r = scene.materials.at(0);
  const Texture& t = scene.textures.at(static_cast<size_t>(r.find("base_color_texture")->texture.texture));
  EXPECT_EQ(t.format, TexelFormat::kSrgb8);
  EXPECT_EQ(t.texels[0], std::byte{10});
  EXPECT_EQ(r.find("emission_texture")->texture.texture, r.find("base_color_texture")->texture.texture);
  const Texture& f =
      scene.textures.at(static_cast<size_t>(r.find("metallic_roughness_texture")->texture.texture));
  EXPECT_EQ(f.format, TexelFormat::kUnorm8);
  EXPECT_EQ(f.texels[1], std::byte{128});
  EXPECT_EQ(scene.meshes.at(0).uv[0].size(), 3u);
}

TEST(Textures, UnusedOnesAreNotDecoded) {
  GltfBuilder b;
  b.image(bytes_of("not an image"));
  const int black = b.image(test::small_png(1, 1, 1));
  b.textured_triangle({{"emissiveTexture", {{"index", black}}}});  // times a factor of 0
  const ImportResult r = imported(b);
  EXPECT_TRUE(r.scene.textures.empty());
  EXPECT_TRUE(r.scene.meshes.at(0).uv[0].empty());
  EXPECT_FALSE(test::says(test::all_notes(r), "image 0"));
}

TEST(Textures, AlphaIsKeptOnlyWhereItMatters) {
  for (const char* mode : {"OPAQUE", "MASK", "BLEND"}) {
    GltfBuilder b;
    json m = base_color(b.image(std::as_bytes(std::span(kRgbaPng))));
    m["alphaMode"] = mode;
    b.textured_triangle(m);
    const Scene scene = imported(b).scene;
    ASSERT_EQ(scene.textures.size(), 1u);
    const Texture& t = scene.textures[0];
    const bool keep = std::string(mode) != "OPAQUE";
    ASSERT_EQ(t.channels, keep ? 4u : 3u) << mode;
    EXPECT_EQ(t.texels[0], std::byte{200});
    EXPECT_EQ(t.texels[2], std::byte{50});
    if (keep) EXPECT_EQ(t.texels[3], std::byte{128});
    EXPECT_EQ(t.texels[t.channels], std::byte{1}) << "second texel";
  }
}

TEST(Textures, TransformIsAnAffineMap) {
  GltfBuilder b;
  json m = base_color(b.image(test::small_png(1, 1, 1)));
  m["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"] =
      json::parse(R"({"offset": [0.5, 0.25], "rotation": 1.57079632679, "scale": [2, 3], "texCoord": 1})");
  b.textured_triangle(m);
  const Record r = imported(b).scene.materials.at(0);
  const TextureUse use = r.find("base_color_texture")->texture;
  EXPECT_EQ(use.uv_set, 1u);
  // The extension's own matrix, multiplied out for a quarter turn: u' = 3 v + 0.5, v' = -2 u + 0.25.
  const float expected[6] = {0, 3, 0.5f, -2, 0, 0.25f};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(use.m[i], expected[i], 1e-6f) << i;
}

TEST(Textures, SamplerIsKept) {
  GltfBuilder b;
  b.root["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
  const int t = b.image(test::small_png(1, 1, 1));
  b.root["textures"][t]["sampler"] = 0;
  b.textured_triangle(base_color(t));
  const Texture texture = imported(b).scene.textures.at(0);
  EXPECT_EQ(texture.wrap_s, Wrap::kClamp);
  EXPECT_EQ(texture.wrap_t, Wrap::kMirror);
  EXPECT_TRUE(texture.nearest);
}

TEST(Textures, MissingAndBrokenOnesWarnAndTheFactorStays) {
  GltfBuilder b;
  json m = base_color(b.image(bytes_of("\x89PNG\r\n\x1a\nbroken")));
  m["pbrMetallicRoughness"]["baseColorFactor"] = {0.5, 0.5, 0.5, 1};
  b.textured_triangle(m);
  b.root["images"].push_back({{"uri", "gone.png"}});
  b.root["textures"].push_back({{"source", 1}});
  b.textured_triangle(base_color(1));
  b.root["images"].push_back({{"uri", "../../etc/passwd"}});
  b.root["textures"].push_back({{"source", 2}});
  b.textured_triangle(base_color(2));
  b.textured_triangle(base_color(77));
  b.root["textures"].push_back({{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}});
  b.textured_triangle(base_color(3));
  b.root["images"].push_back({{"bufferView", 1000}});
  b.root["textures"].push_back({{"source", 3}});
  b.textured_triangle(base_color(4));
  const ImportResult r = imported(b);
  EXPECT_TRUE(r.scene.textures.empty());
  ASSERT_EQ(r.scene.materials.size(), 6u);
  for (const Record& material : r.scene.materials) EXPECT_FALSE(material.find("base_color_texture"));
  EXPECT_EQ(r.scene.materials[0].find("base_color")->numbers[0], 0.5);
  const std::string notes = test::all_notes(r);
  EXPECT_SAYS(notes, "x.glb: image 0: it does not decode");
  EXPECT_SAYS(notes, "image 1: missing file gone.png; the material's factor is used without it");
  EXPECT_SAYS(notes, "leaves the folder of the scene");
  EXPECT_SAYS(notes, "texture 77 does not exist, there are 5");
  EXPECT_SAYS(notes, "texture 3 has no image in a format that is supported");
  EXPECT_SAYS(notes, "buffer view 1000 does not exist");
  size_t warnings = 0;
  for (const ImportNote& note : r.notes) warnings += test::says(note.what, "the material's factor is used");
  EXPECT_EQ(warnings, 6u);
}

TEST(Textures, FilesAndDataUris) {
  test::TempDir dir;
  GltfBuilder b;
  b.root["images"] = {
      {{"uri", "sub/my%20wall.png"}, {"name", "wall"}},
      {{"uri",
        "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAYAAAD0In+KAAAAEUlEQVR4nGM4kWLUwMjE/"
        "B8ADcAC5LW2FcMAAAAASUVORK5CYII="}}};
  b.root["textures"] = {{{"source", 0}}, {{"source", 1}}};
  b.textured_triangle(base_color(0));
  b.textured_triangle(base_color(1));
  std::filesystem::create_directory(dir.path() / "sub");
  ASSERT_TRUE(write_file_atomic(dir.path() / "sub/my wall.png", test::small_png(7, 8, 9)));
  const auto r = import_scene(test::write_gltf_file(b, dir.path()), {});
  ASSERT_TRUE(r) << r.error().message;
  ASSERT_EQ(r->scene.textures.size(), 2u) << test::all_notes(*r);
  EXPECT_EQ(r->scene.textures[0].name, "wall");
  EXPECT_EQ(r->scene.textures[0].texels[1], std::byte{8});
  EXPECT_EQ(r->scene.textures[1].texels[0], std::byte{200});
}

TEST(Textures, LargeOnesAreReduced) {
  GltfBuilder b;
  const int large = b.image(test::small_png(50, 60, 70, 2050));
  b.textured_triangle(base_color(large));
  json mask = base_color(large);
  mask["alphaMode"] = "MASK";
  b.textured_triangle(mask);
  const ImportResult r = imported(b);
  ASSERT_EQ(r.scene.textures.size(), 2u);
  EXPECT_LE(r.scene.textures[0].width, 1024u);
  EXPECT_EQ(r.scene.textures[1].width, 1025u) << "a mask keeps up to 2048: halved once";
  EXPECT_SAYS(test::note_with(r, "reduced"), "2 textures: 'image 0', 'image 0'");
}

TEST(Textures, UvSetsThatAreNotThere) {
  GltfBuilder b;
  const int t = b.image(test::small_png(1, 1, 1));
  json m = base_color(t);
  m["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 2;
  b.textured_triangle(m);
  const int bare = b.triangle();
  b.root["meshes"][bare]["primitives"][0]["material"] = b.material(base_color(t));
  b.node({{"mesh", bare}});
  const ImportResult r = imported(b);
  EXPECT_SAYS(test::all_notes(r), "material 0: base_color_texture uses TEXCOORD_2, only 0 and 1 are read");
  EXPECT_SAYS(test::all_notes(r),
              "which is absent: until it is there, their corner texel colours all, in 1 primitive: mesh 1 "
              "primitive 0");
}

TEST(Textures, NormalMapsAreLinearAndLoadedWhereTheyTilt) {
  for (const double scale : {0.0, 0.5, 1.0}) {
    GltfBuilder b;
    b.textured_triangle(
        {{"name", "bricks"},
         {"normalTexture", {{"index", b.image(test::small_png(1, 128, 255))}, {"scale", scale}}}});
    const Scene scene = imported(b).scene;
    ASSERT_EQ(scene.textures.size(), scale == 0 ? 0u : 1u) << scale;
    if (scale == 0) continue;
    EXPECT_EQ(scene.textures[0].format, TexelFormat::kUnorm8);
    EXPECT_EQ(scene.textures[0].channels, 3u);
    const Property* s = scene.materials.at(0).find("normal_scale");
    EXPECT_EQ(s ? s->numbers.at(0) : 1.0, scale);
    EXPECT_FALSE(scene.meshes.at(0).uv[0].empty()) << "the tangent frame needs them";
  }
}

// A square of 1 m with a texture of 512 texels a side, seen by a lightmap of 4 texels a metre.
Scene dense(const json& material, Bytes image) {
  GltfBuilder b;
  json m = material;
  const int t = b.image(image);
  m["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", t}};
  b.textured_triangle(m);
  BakeSettings settings;
  settings.layout = "pack";
  return imported(b, settings).scene;
}

TEST(Textures, AreReducedToWhatTheLightmapResolves) {
  const Bytes image = test::small_png(10, 20, 30, 512);
  // 4 x 4 texels a metre are wanted; halving stops at the last size that is not below.
  EXPECT_EQ(dense(json::object(), image).textures.at(0).width, 16u);
  EXPECT_EQ(dense({{"alphaMode", "BLEND"}}, image).textures.at(0).width, 512u) << "it cuts shapes";
  EXPECT_EQ(dense(json::object(), image).textures.at(0).texels.at(1), std::byte{20});
}

}  // namespace
}  // namespace kiln
