// A lit floor and a black sheet above it: only where the back of the sheet faces light is it named.
#include "coordinator/run/black_fronts.h"

#include <gtest/gtest.h>

#include "tests/atlas/shapes.h"

namespace kiln {
namespace {

using namespace test;

constexpr float kSize = 4;

struct Case {
  bool double_sided = true, up = true, sky = false, floor = true;
  float light = 0;  // of the sheet; the floor has 1
};

Mat4x3 facing(bool up, const Vec3& origin) {
  if (up) return at(origin);
  return {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, -1), origin + Vec3(0, 0, kSize)};
}

std::string warning(const Case& of) {
  Scene scene = scene_of({plane(4, kSize, Uv::kNone), plane(4, kSize, Uv::kNone)});
  scene.materials.clear();
  for (const double sides : {0.0, of.double_sided ? 1.0 : 0.0}) {
    Record material;
    material.type = "metallic_roughness";
    material.properties.push_back({"double_sided", {sides}, "", {}});
    scene.instances[scene.materials.size()].material = static_cast<uint32_t>(scene.materials.size());
    scene.materials.push_back(material);
  }
  scene.instances[0].name = "floor";
  scene.instances[0].to_world = facing(of.floor, Vec3(0.0f));
  scene.instances[1].name = "sheet";
  scene.instances[1].to_world = facing(of.up, Vec3(0, 1, 0));
  if (of.sky) {
    Record sky;
    sky.type = "environment";
    sky.properties.push_back({"radiance", {1, 1, 1}, "", {}});
    scene.lights.push_back(sky);
  }
  const auto atlas = build_atlas(scene, pack_at(4));
  EXPECT_TRUE(atlas) << atlas.error().message;
  Lightmap map;
  map.page_height = atlas->height;
  map.planes.width = atlas->width;
  map.planes.height = atlas->height * atlas->pages;
  for (const char* name : {"E.R", "E.G", "E.B"}) map.planes.add(name);
  map.validity.assign(atlas->texel_count(), Validity::kEmpty);
  for (const uint32_t texel : atlas->sites.texel) {
    map.validity[texel] = Validity::kMeasured;
    const bool of_floor = atlas->owner[texel] - 1 < atlas->instance_first_chart[1];
    for (std::vector<float>& plane : map.planes.data) plane[texel] = of_floor ? 1.0f : of.light;
  }
  return warn_of_black_fronts(scene, *atlas, map);
}

TEST(BlackFronts, AWallWhoseBackFacesLitSurfacesIsNamed) {
  const std::string said = warning({});
  EXPECT_NE(said.find("'sheet'"), std::string::npos) << said;
  EXPECT_EQ(said.find("'floor'"), std::string::npos) << said;
  EXPECT_NE(said.find("flip the normals"), std::string::npos) << said;
}

TEST(BlackFronts, ASheetThatIsRightlyBlackIsNot) {
  EXPECT_EQ(warning({.double_sided = false}), "") << "renderers do not show its back";
  EXPECT_EQ(warning({.up = false}), "") << "behind it is nothing";
  EXPECT_EQ(warning({.floor = false}), "") << "behind it are backs";
  EXPECT_EQ(warning({.light = 0.1f}), "") << "its front is lit";
  EXPECT_NE(warning({.up = false, .sky = true}), "") << "behind it is the sky";
}

}  // namespace
}  // namespace kiln
