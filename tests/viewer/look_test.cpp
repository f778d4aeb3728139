// Colours of previews, by hand-made scenes.
#include <gtest/gtest.h>

#include "coordinator/output/look/surface_look.h"
#include "coordinator/report/preview.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {

// A triangle whose coordinates are its barycentrics, with a black and a white texel side by side.
Scene two_texels(bool nearest) {
  Scene scene;
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.normals.assign(3, Vec3(0, 0, 1));
  mesh.uv[0] = {{0, 0}, {1, 0}, {0, 1}};
  mesh.triangles = {{0, 1, 2}};
  scene.meshes.push_back(mesh);
  scene.instances.push_back({});
  Texture texture;
  texture.width = 2, texture.height = 1, texture.channels = 3;
  texture.format = TexelFormat::kSrgb8;
  texture.nearest = nearest;
  texture.texels.assign(3, std::byte{0});
  texture.texels.insert(texture.texels.end(), 3, std::byte{255});
  scene.textures.push_back(texture);
  TextureUse use;
  use.texture = 0;
  Property color{"base_color_texture", {}, "", use};
  scene.materials.push_back({"metallic_roughness", "", Mat4x3{1.0f}, {color}});
  return scene;
}

float red_at(const Scene& scene, float u) {
  const Atlas atlas;
  const Lightmap map;
  Fragment fragment;
  fragment.b1 = u;
  return SurfaceLook(scene, atlas, map).base_color(fragment).x;
}

TEST(SurfaceLook, MixesTexelsInLinearLight) {
  const Scene scene = two_texels(false);
  EXPECT_NEAR(red_at(scene, 0.25f), 0, 1e-6);
  EXPECT_NEAR(red_at(scene, 0.375f), 0.25, 1e-6);
  EXPECT_NEAR(red_at(scene, 0.5f), 0.5, 1e-6);
  EXPECT_NEAR(red_at(scene, 0.75f), 1, 1e-6);
}

TEST(SurfaceLook, MixesAcrossTheEdgeAsTheSamplerWraps) {
  Scene scene = two_texels(false);
  EXPECT_NEAR(red_at(scene, 0), 0.5, 1e-6);  // repeated: half of the last texel
  EXPECT_NEAR(red_at(scene, 0.875f), 0.75, 1e-6);
  for (const Wrap wrap : {Wrap::kClamp, Wrap::kMirror}) {
    scene.textures[0].wrap_s = wrap;
    EXPECT_NEAR(red_at(scene, 0), 0, 1e-6);
    EXPECT_NEAR(red_at(scene, 1), 1, 1e-6);
  }
  scene.textures[0].wrap_s = Wrap::kMirror;
  for (Vec2& uv : scene.meshes[0].uv[0]) uv *= -3;
  EXPECT_NEAR(red_at(scene, 0.25f), 1, 1e-6);      // -0.75
  EXPECT_NEAR(red_at(scene, 2.25f / 3), 0, 1e-6);  // -2.25
}

TEST(SurfaceLook, ReadsOneTexelWhereTheSamplerAsksForTheNearest) {
  const Scene scene = two_texels(true);
  EXPECT_EQ(red_at(scene, 0.49f), 0);
  EXPECT_EQ(red_at(scene, 0.51f), 1);
}

TEST(SurfaceLook, TakesTransparentBlendedSurfacesForVeils) {
  Scene scene = two_texels(false);
  Record& material = scene.materials[0];
  material.properties.push_back({"base_color", {1, 1, 1, 0.3}, "", {}});
  material.properties.push_back({"alpha_mode", {}, "mask", {}});
  const Atlas atlas;
  const Lightmap map;
  Fragment fragment, back;
  back.back = true;
  EXPECT_FALSE(SurfaceLook(scene, atlas, map).is_veil(fragment));  // cut out
  material.properties.back().word = "blend";
  const SurfaceLook look(scene, atlas, map);
  EXPECT_TRUE(look.has_veils() && look.is_veil(fragment) && !look.visible(fragment));
  EXPECT_FALSE(look.is_veil(back));
  material.properties.front().texture = {};
  material.properties[1].numbers[3] = 0.8;
  EXPECT_FALSE(SurfaceLook(scene, atlas, map).is_veil(fragment));  // shown as solid
}

// Red of a white triangle behind which, or before which, a blue one of alpha 0.3 stands, both in a light of
// E = pi.
int red_beside_water(double z, const char* mode) {
  test::GltfBuilder b;
  b.textured_triangle({{"pbrMetallicRoughness", {{"metallicFactor", 0}}}});
  b.textured_triangle(
      {{"alphaMode", mode},
       {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"baseColorFactor", {0, 0, 1, 0.3}}}}});
  b.root["nodes"].back()["translation"] = {0, 0, z};
  const ImportResult imported = test::imported(b);
  AtlasSettings layout;
  layout.layout = AtlasSettings::Layout::kPack;
  const Atlas atlas = *build_atlas(imported.scene, layout);
  Lightmap map;
  map.page_height = atlas.height;
  map.planes.width = atlas.width;
  map.planes.height = atlas.height * atlas.pages;
  for (const char* name : {"E.R", "E.G", "E.B"})
    map.planes.add(name).assign(atlas.owner.size(), static_cast<float>(M_PI));
  map.validity.assign(atlas.owner.size(), Validity::kMeasured);
  Camera camera;
  camera.to_world[3] = Vec3(0.3f, 0.3f, 2);
  camera.vertical_fov = 0.1f;
  ViewStyle style;
  style.exposure = 1;
  style.filmic = false;
  return render_view(imported, atlas, map, camera, 1, 1, style).rgb[0];
}

TEST(Preview, LaysBlendedSurfacesOverWhatIsBehindThem) {
  EXPECT_NEAR(red_beside_water(0.5, "BLEND"), 0.7 * 255, 0.51);
  EXPECT_EQ(red_beside_water(-0.5, "BLEND"), 255);
  EXPECT_EQ(red_beside_water(0.5, "MASK"), 255) << "cut out";
  EXPECT_EQ(red_beside_water(0.5, "OPAQUE"), 0);
}

}  // namespace
}  // namespace kiln
