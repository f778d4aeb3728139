// What the plan says a scene does not need.
#include "coordinator/bake/plan/plan.h"

#include <algorithm>

namespace kiln {
namespace {

Record material(std::vector<Property> properties) {
  return {"metallic_roughness", "m", Mat4x3(1.0f), std::move(properties)};
}

// One triangle of the material, one light.
std::vector<std::string> left_out(Record m, Record light, bool texture = false) {
  Scene scene;
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  mesh.normals.assign(3, Vec3(0, -1, 0));
  mesh.triangles = {{0, 1, 2}};
  mesh.source_triangle = {0};
  scene.meshes.push_back(mesh);
  scene.instances.push_back({0, 0, Mat4x3(1.0f), "t", 0, 0, 0});
  scene.materials.push_back(std::move(m));
  scene.lights.push_back(std::move(light));
  if (texture) scene.textures.emplace_back();
  return make_plan(scene, Atlas{}, BakeSettings{}, 1).left_out;
}
bool says(const std::vector<std::string>& left_out, const std::string& words) {
  return std::any_of(left_out.begin(), left_out.end(),
                     [&](const std::string& s) { return s.find(words) != s.npos; });
}

// Lights that texels are lit by in reflections alone leave a bake its cache, which asks for a sum of all
// light.
TEST(Plan, LightsBakedByReflectionsKeepTheCache) {
  Scene scene;
  scene.lights.push_back({"point", "lamp", Mat4x3(1.0f), {}});
  BakeSettings s;
  EXPECT_EQ(why_no_cache(s), "");
  const auto without_parts = [&] {
    const Quantities q = job_quantities(scene, s);
    return !q.all_light && !q.direct_apart;
  };
  EXPECT_TRUE(without_parts() && job_quantities(scene, s).cache_draws);
  scene.lights.back().properties.push_back({"bake", {}, "indirect", {}});
  EXPECT_TRUE(job_quantities(scene, s).all_light);
  s.cache = false;  // nobody would read it
  EXPECT_EQ(job_quantities(scene, s), Quantities{});
  s.cache = true;
  s.max_bounces = 2;  // paths of two reflections end at no cache
  EXPECT_NE(why_no_cache(s), "");
  EXPECT_EQ(job_quantities(scene, s), Quantities{});
  s = {};
  s.direct = false;  // caches hold reflected light alone, whatever the lights
  EXPECT_TRUE(without_parts());
  s = {};
  s.split = true;
  EXPECT_TRUE(job_quantities(scene, s).direct_apart && job_quantities(scene, s).all_light);
}

const Record kSun{"directional", "sun", Mat4x3(1.0f), {}};
const Record kLamp{"ies", "lamp", Mat4x3(1.0f), {}};

TEST(Plan, LambertUnderASunNeedsLittle) {
  const auto out = left_out(material({{"metallic", {0}, "", {}}, {"specular", {0}, "", {}}}), kSun);
  for (const char* words : {"every surface is Lambert", "no glass", "no normal maps", "no environment",
                            "no lamps", "every surface is opaque", "no textures", "no mesh repeats"})
    EXPECT_TRUE(says(out, words)) << words;
  EXPECT_FALSE(says(out, "no directional light"));
}

TEST(Plan, WhatIsThereIsNotLeftOut) {
  TextureUse use;
  use.texture = 0;
  const auto out = left_out(material({{"transmission", {0.5}, "", {}},
                                      {"clearcoat", {1}, "", {}},
                                      {"alpha_mode", {}, "blend", {}},
                                      {"normal_texture", {}, "", use}}),
                            kLamp, true);
  for (const char* words : {"every surface is Lambert", "no glass", "no normal maps", "no lamps",
                            "no clear coat", "every surface is opaque", "no textures"})
    EXPECT_FALSE(says(out, words)) << words;
  EXPECT_TRUE(says(out, "no directional light"));
}

TEST(Plan, GltfsDefaultMaterialIsGlossy) {
  const auto out = left_out(material({}), kSun);
  EXPECT_FALSE(says(out, "every surface is Lambert"));
  EXPECT_TRUE(says(out, "no clear coat"));
}

}  // namespace
}  // namespace kiln
