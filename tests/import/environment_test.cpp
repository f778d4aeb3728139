#include <array>
#include <cstring>

#include "common/base/files.h"
#include "coordinator/scene/import/cube_map.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;
using test::refused;
using N = std::vector<double>;

Vec3 texel(const Texture& t, uint32_t x, uint32_t y) {
  Vec3 out;
  std::memcpy(&out, t.texels.data() + (size_t{y} * t.width + x) * sizeof out, sizeof out);
  return out;
}

// The texel of an equirectangular image that looks along d, by the mapping that scene.h documents.
Vec3 looking_at(const Texture& t, const Vec3& d) {
  const double u = 0.5 + std::atan2(d.x, -d.z) / (2 * kPi), v = std::acos(d.y / length(d)) / kPi;
  return texel(t, std::min(static_cast<uint32_t>(u * t.width), t.width - 1),
               std::min(static_cast<uint32_t>(v * t.height), t.height - 1));
}

// Face i has the colour (i, 0, 0), and (i, 1, 0) in its right half, (i, ?, 1) in its upper half.
std::array<CubeFace, 6> marked_faces(uint32_t size) {
  std::array<CubeFace, 6> faces;
  for (size_t i = 0; i < 6; ++i) {
    faces[i].size = size;
    for (uint32_t y = 0; y < size; ++y)
      for (uint32_t x = 0; x < size; ++x)
        faces[i].texels.emplace_back(static_cast<float>(i), x >= size / 2 ? 1.0f : 0.0f,
                                     y < size / 2 ? 1.0f : 0.0f);
  }
  return faces;
}

TEST(CubeMap, FacesLookRightFromInside) {
  const Texture t = cube_to_equirectangular(marked_faces(16), {0, 0, 0, 1});
  EXPECT_EQ(t.width, 64u);
  EXPECT_EQ(t.height, 32u);
  // Along each horizontal axis, a little to the right and up of it: right = forward x up.
  const std::array<std::pair<size_t, Vec3>, 4> sides{
      {{0, {1, 0, 0}}, {1, {-1, 0, 0}}, {4, {0, 0, 1}}, {5, {0, 0, -1}}}};
  for (const auto& [face, forward] : sides) {
    const Vec3 up(0, 1, 0), right = cross(forward, up);
    const auto f = static_cast<float>(face);
    EXPECT_EQ(looking_at(t, forward + 0.4f * right + 0.4f * up), Vec3(f, 1, 1)) << face;
    EXPECT_EQ(looking_at(t, forward - 0.4f * right - 0.4f * up), Vec3(f, 0, 0)) << face;
    EXPECT_EQ(looking_at(t, forward + 0.4f * right - 0.4f * up), Vec3(f, 1, 0)) << face;
  }
  EXPECT_EQ(looking_at(t, {0.1f, 1, 0.1f}).x, 2);
  EXPECT_EQ(looking_at(t, {0.1f, -1, 0.1f}).x, 3);
  // The lower edge of the upper face meets +z, as in every cross layout that has +z below +y.
  EXPECT_EQ(looking_at(t, {-0.4f, 1, 0.4f}), Vec3(2, 1, 0));
  EXPECT_EQ(looking_at(t, {0.4f, 1, -0.4f}), Vec3(2, 0, 1));
}

TEST(CubeMap, RotationTurnsTheCube) {
  const double half = std::sqrt(0.5);
  // A quarter turn about +y takes +z to +x.
  const Texture t = cube_to_equirectangular(marked_faces(16), {0, half, 0, half});
  EXPECT_EQ(looking_at(t, {1, 0.1f, 0.1f}).x, 4);
  EXPECT_EQ(looking_at(t, {0.1f, 0.1f, -1}).x, 0);
}

GltfBuilder with_cube() {
  GltfBuilder b;
  b.node({{"mesh", b.triangle()}});
  json faces;
  for (uint8_t i = 0; i < 6; ++i) {
    const int texture = b.image(test::small_png(static_cast<uint8_t>(40 * i), 255, 0, 8));
    faces.push_back(b.root["textures"][texture]["source"]);
  }
  b.root["extensionsUsed"] = {"EXT_lights_image_based"};
  b.root["extensions"]["EXT_lights_image_based"]["lights"] = {
      {{"intensity", 3}, {"specularImages", {faces}}}};
  b.root["scenes"][0]["extensions"]["EXT_lights_image_based"]["light"] = 0;
  return b;
}

TEST(Environment, ImageBasedLight) {
  BakeSettings settings;
  settings.environment_strength = 2;
  settings.environment_rotation = 90;
  const ImportResult r = imported(with_cube(), settings);
  ASSERT_EQ(r.scene.lights.size(), 1u) << test::all_notes(r);
  const Record& l = r.scene.lights[0];
  EXPECT_EQ(l.type, "environment");
  EXPECT_EQ(l.find("radiance")->numbers, (N{6, 6, 6}));
  EXPECT_EQ(l.find("rotation")->numbers, (N{90}));
  const Texture& t = r.scene.textures.at(static_cast<size_t>(l.find("image")->texture.texture));
  EXPECT_EQ(t.format, TexelFormat::kFloat32);
  EXPECT_NEAR(length(looking_at(t, {0, 0, -1}) - Vec3(srgb_to_linear(200 / 255.0f), 1, 0)), 0, 1e-6f);
}

TEST(Environment, UnusableImageBasedLightIsAWarning) {
  GltfBuilder b = with_cube();
  b.root["extensions"]["EXT_lights_image_based"]["lights"][0]["specularImages"][0][3] = 99;
  ImportResult r = imported(b);
  EXPECT_TRUE(r.scene.lights.empty());
  EXPECT_SAYS(test::all_notes(r), "image-based light 0 is left out");
  EXPECT_SAYS(test::all_notes(r), "image 99 does not exist");
  b.root["extensions"]["EXT_lights_image_based"]["lights"][0].erase("specularImages");
  EXPECT_SAYS(test::all_notes(imported(b)), "specularImages does not name six images");
  b.root["scenes"][0]["extensions"]["EXT_lights_image_based"]["light"] = 4;
  EXPECT_SAYS(refused(b), "the scene names image-based light 4, which does not exist");
}

TEST(Environment, ConstantOfTheSettingsOverrides) {
  BakeSettings settings;
  settings.environment = "1,0.5,2e1";
  settings.environment_strength = 2;
  const ImportResult r = imported(with_cube(), settings);
  ASSERT_EQ(r.scene.lights.size(), 1u);
  EXPECT_EQ(r.scene.lights[0].find("radiance")->numbers, (N{2, 1, 40}));
  EXPECT_FALSE(r.scene.lights[0].find("image"));
  EXPECT_TRUE(r.scene.textures.empty());
  settings.environment = "1,-1,0";
  const auto negative = test::import(with_cube(), settings);
  ASSERT_FALSE(negative);
  EXPECT_EQ(negative.error().kind, ErrorKind::kUsage);
}

TEST(Environment, FileOfTheSettings) {
  test::TempDir dir;
  std::string hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n";
  hdr += std::string("\x80\x80\x80\x81\x80\x80\x80\x82", 8);
  ASSERT_TRUE(write_file_atomic(dir.path() / "sky.hdr", hdr));
  BakeSettings settings;
  settings.environment = (dir.path() / "sky.hdr").string();
  settings.environment_strength = 0.5;
  const ImportResult r = imported(test::small_scene(), settings);
  ASSERT_EQ(r.scene.lights.size(), 2u);
  const Record& l = r.scene.lights[1];
  EXPECT_EQ(l.find("radiance")->numbers, (N{0.5, 0.5, 0.5}));
  const Texture& t = r.scene.textures.at(static_cast<size_t>(l.find("image")->texture.texture));
  EXPECT_NEAR(texel(t, 1, 0).x / texel(t, 0, 0).x, 2.0f, 1e-5f);
  settings.environment = (dir.path() / "gone.hdr").string();
  EXPECT_SAYS(refused(test::small_scene(), settings), "gone.hdr: no such file");
}

}  // namespace
}  // namespace kiln
