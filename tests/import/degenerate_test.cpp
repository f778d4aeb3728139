// Geometry and numbers that files should not have, through the whole import.
#include "common/scene/prepared.h"
#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;

// Two million triangles without area and one with: what is left is the one, and nothing of the others stays
// in memory. They share 3 vertices, so that the file stays small.
TEST(Degenerate, MillionsOfFlatTriangles) {
  constexpr size_t kFlat = 2'000'000;
  GltfBuilder b;
  json p;
  p["attributes"]["POSITION"] = b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0});
  std::vector<uint8_t> indices(3 * kFlat, 0);
  for (size_t i = 0; i < indices.size(); i += 3) indices[i + 1] = 1;  // 0, 1, 0
  indices.insert(indices.end(), {0, 1, 2});
  p["indices"] = b.accessor_of(indices, 5121, "SCALAR", 1);
  b.node({{"mesh", b.mesh(p)}});
  const ImportResult result = imported(b);
  const Mesh& mesh = result.scene.meshes.at(0);
  ASSERT_EQ(mesh.triangles.size(), 1u);
  EXPECT_EQ(mesh.source_triangle[0], kFlat);
  EXPECT_LT(mesh.triangles.capacity(), 16u);
  EXPECT_SAYS(test::note_with(result, "without area"), "2000000");
}

TEST(Degenerate, RepeatedTrianglesAreLeftOutAndNoted) {
  GltfBuilder b;
  json p;
  p["attributes"]["POSITION"] = b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0});
  p["indices"] = b.accessor_of(std::vector<uint8_t>{0, 1, 2, 4, 5, 3, 0, 2, 1}, 5121, "SCALAR", 1);
  b.node({{"mesh", b.mesh(p)}});
  const ImportResult result = imported(b);
  EXPECT_EQ(result.scene.meshes.at(0).source_triangle, (std::vector<uint32_t>{0, 2}));
  EXPECT_SAYS(test::note_with(result, "repeat"), "triangles that repeat another one are left out: 1");
}

// Normals that are zero, short, long, turned against the triangle, or not numbers come out unit; which side
// they are on is left to the file.
TEST(Degenerate, NormalsComeOutUnit) {
  const float nan = std::nanf("");
  for (const std::vector<float>& n :
       std::vector<std::vector<float>>{{0, 0, 0, 0, 0, 0, 0, 0, 0},
                                       {0, 0, 1e-20f, 0, 0, 1e-30f, 0, 0, 1e-38f},
                                       {0, 0, 1e20f, 0, 0, 3e38f, 0, 3e38f, 3e38f},
                                       {0, 0, -1, 0, 0, -2, 0, 0, -0.5f},
                                       {nan, 0, 1, 0, 0, 1, 0, nan, 0}}) {
    GltfBuilder b;
    json p;
    p["attributes"]["POSITION"] = b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0});
    p["attributes"]["NORMAL"] = b.vec3(n);
    b.node({{"mesh", b.mesh(p)}});
    const ImportResult result = imported(b);
    for (const Vec3& normal : result.scene.meshes.at(0).normals)
      EXPECT_NEAR(length(normal), 1, 1e-6f) << n[2];
    EXPECT_TRUE(check_scene(result.scene)) << n[2];
  }
}

// Factors from the smallest float to 1e30 and strengths beyond it: what a float holds is kept, the rest is no
// radiance and said so.
TEST(Degenerate, EmissionOfAnySize) {
  const auto emission = [](double factor, double strength, std::string* note = nullptr) {
    GltfBuilder b = test::small_scene();
    b.root["extensionsUsed"] = {"KHR_materials_emissive_strength"};
    const int material =
        b.material({{"emissiveFactor", {factor, 0, 0}},
                    {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", strength}}}}}});
    b.root["meshes"][0]["primitives"][0]["material"] = material;
    const ImportResult result = imported(b);
    if (note) *note = test::all_notes(result);
    const Property* p = result.scene.materials.at(0).find("emission");
    return p ? p->numbers.at(0) : -1.0;
  };
  EXPECT_DOUBLE_EQ(emission(1, 1e-40), 1e-40);  // a denormal float
  EXPECT_DOUBLE_EQ(emission(1, 1e30), 1e30);
  std::string note;
  EXPECT_EQ(emission(1, 1e300, &note), 0);
  EXPECT_SAYS(note, "taken as 0");
}

}  // namespace
}  // namespace kiln
