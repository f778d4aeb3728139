// What --materials diffuse sees of a material, and that a scene of it is one of Lambert surfaces.
#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"
#include "tests/materials/roster.h"

namespace kiln {
namespace {
using test::put;

Record record_of(std::vector<Property> properties) {
  return {"diffuse", "m", Mat4x3(1.0f), std::move(properties)};
}
Material material_of(std::vector<Property> properties, const Scene& scene = {}) {
  std::vector<std::string> warnings;
  Material m = parse_material(record_of(std::move(properties)), scene, warnings).value();
  EXPECT_TRUE(warnings.empty()) << warnings[0];
  return m;
}
Property word(std::string name, std::string value) {
  return {std::move(name), {}, std::move(value), {}};
}

TEST(Diffuse, IsBaseColourTimesWhatIsNotMetal) {
  const Material m = material_of({put("base_color", {0.8, 0.4, 0.2, 1}), put("metallic", {0.25})});
  Attributes a;
  a.color = Vec4(0.5f, 1.0f, 4.0f, 1.0f);
  const Vec3 expected(0.75f * 0.4f, 0.75f * 0.4f, 0.75f * 0.8f);
  EXPECT_LE(length(albedo_at(m, a) - expected), 1e-6f);
  EXPECT_LE(length(bsdf_at(m, a).diffuse - expected), 1e-6f);
  EXPECT_FALSE(bsdf_at(m, a).has_specular());
  EXPECT_EQ(layers_of(m), Layers::kLambert);
  EXPECT_FALSE(is_glass(m));
  EXPECT_EQ(normal_map_of(m), nullptr);
}

TEST(Diffuse, MetalnessIsTheTexturesBlue) {
  Scene s;
  Texture t;
  t.name = "factors", t.width = t.height = 1, t.channels = 3, t.format = TexelFormat::kUnorm8;
  for (const int c : {0, 255, 51}) t.texels.push_back(std::byte(static_cast<uint8_t>(c)));
  s.textures.push_back(t);
  Property texture{"metallic_roughness_texture", {}, "", {}};
  texture.texture.texture = 0;
  const Material m = material_of({put("base_color", {1, 1, 1, 1}), put("metallic", {0.5}), texture}, s);
  const double blue = std::get<Diffuse>(m).albedo({}).x;
  // Factors are linear or sRGB as the texture says; 51/255 is 0.2 linear.
  EXPECT_NEAR(blue, 1 - 0.5 * 0.2, 1e-6);
}

TEST(Diffuse, WhatItTransmitsIsNotCovered) {
  EXPECT_FLOAT_EQ(opacity_at(material_of({put("metallic", {0}), put("transmission", {0.75})}), {}), 0.25f);
  EXPECT_FLOAT_EQ(opacity_at(material_of({put("metallic", {0.5}), put("transmission", {0.75})}), {}), 0.625f);
  const Material leaf = material_of({put("metallic", {0}), put("transmission", {0.5}),
                                     word("alpha_mode", "blend"), put("base_color", {1, 1, 1, 0.5})});
  EXPECT_FLOAT_EQ(opacity_at(leaf, {}), 0.25f);
  const Attributes corners[3];
  const Range bounds = alpha_of(leaf).bounds(corners);
  EXPECT_LE(bounds.low, 0.25f);
  EXPECT_GE(bounds.high, 0.25f);
  EXPECT_FALSE(is_opaque(leaf));
  EXPECT_TRUE(is_opaque(material_of({put("metallic", {0})})));
  EXPECT_TRUE(is_opaque(material_of({put("metallic", {1}), put("transmission", {1})})));
}

// A closed room that shines: base colour 0.5 gives 2 pi, and the bytes are those of a Lambert material's
// room.
test::Bake room(const Record& wall) {
  test::SceneMaker m;
  m.scene().materials.push_back(wall);
  m.box({0, 0, 0}, {1, 1, 1}, true);
  TransportSettings s;
  s.max_bounces = 1000;
  return test::bake(m.take(), 6, 1024, s);
}

TEST(Diffuse, RoomIsThatOfLambertWalls) {
  const Property color = put("base_color", {0.5, 0.5, 0.5, 1}), light = put("emission", {1, 1, 1});
  const test::Bake diffuse = room(record_of({color, light, put("metallic", {0})}));
  const test::Bake lambert = room(
      {"metallic_roughness", "m", Mat4x3(1.0f), {color, light, put("metallic", {0}), put("specular", {0})}});
  ASSERT_EQ(diffuse.texels.size(), lambert.texels.size());
  double mean = 0;
  for (size_t i = 0; i < diffuse.texels.size(); ++i) {
    EXPECT_EQ(diffuse.texels[i].e, lambert.texels[i].e) << i;
    mean += diffuse.texels[i].luminance / static_cast<double>(diffuse.texels.size());
  }
  EXPECT_NEAR(mean, 2 * M_PI, 0.002 * 2 * M_PI);
}

// Through a pane that transmits half, half of the sky arrives.
TEST(Diffuse, PaneLetsThroughWhatItTransmits) {
  test::SceneMaker m;
  const uint32_t black = m.lambert(Vec3(0.0f));
  m.quad({-0.25f, 0, -0.25f}, {0, 0, 0.5f}, {0.5f, 0, 0}, black);
  m.scene().materials.push_back(record_of({put("metallic", {0}), put("transmission", {0.5}),
                                           put("base_color", {0, 0, 0, 1}), put("double_sided", {1})}));
  m.quad({-11, 0.1f, -13}, {0, 0, 24}, {24, 0, 0}, 1);
  m.sun({0, 1, 0}, Vec3(1.0f));
  const auto b = test::bake(m.take(), 4, 64, {}, 0u);
  for (const auto& t : b.texels) EXPECT_NEAR(t.e.x, 0.5f, 1e-6f);
}

}  // namespace
}  // namespace kiln
