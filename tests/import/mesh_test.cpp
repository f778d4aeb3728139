// Accessors and primitives as they come in files, and as they must not.
#include <limits>

#include "tests/import/gltf_builder.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::json;
using test::refused;

// A quad of two triangles whose positions and other attributes are given.
struct Quad {
  GltfBuilder b;
  json primitive;

  Quad() {
    primitive["attributes"]["POSITION"] = b.vec3({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
    indices(std::vector<uint16_t>{0, 1, 2, 0, 2, 3}, 5123);
  }
  template <class T>
  void indices(const std::vector<T>& list, int type) {
    primitive["indices"] = b.accessor_of(list, type, "SCALAR", 1);
  }
  GltfBuilder& done() {
    b.node({{"mesh", b.mesh(primitive)}});
    return b;
  }
};

TEST(Meshes, AllIndexTypes) {
  Quad q8, q16, q32;
  q8.indices(std::vector<uint8_t>{0, 1, 2, 0, 2, 3}, 5121);
  q32.indices(std::vector<uint32_t>{0, 1, 2, 0, 2, 3}, 5125);
  const Mesh a = imported(q8.done()).scene.meshes.at(0), b = imported(q16.done()).scene.meshes.at(0),
             c = imported(q32.done()).scene.meshes.at(0);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.triangles, c.triangles);
  EXPECT_EQ(a.positions, c.positions);
  EXPECT_EQ(a.source_triangle, (std::vector<uint32_t>{0, 1}));

  Quad none;
  none.primitive.erase("indices");
  none.primitive["mode"] = 5;
  EXPECT_EQ(imported(none.done()).scene.triangle_count(), 2u);
}

TEST(Meshes, AllComponentTypesOfTexcoordOne) {
  // (0, 1), (1, 0), (0.5-ish, 0), as each type writes it; strides of 4 bytes and more.
  const auto uv1 = [](int type, size_t stride, const auto& data, bool normalized) {
    GltfBuilder b;
    json p;
    p["attributes"]["POSITION"] = b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0});
    const int accessor = b.accessor(b.view(data, stride), type, 3, "VEC2");
    b.root["accessors"][accessor]["normalized"] = normalized;
    p["attributes"]["TEXCOORD_1"] = accessor;
    b.node({{"mesh", b.mesh(p)}});
    return imported(b).scene.meshes.at(0).uv[1];
  };
  using V = std::vector<Vec2>;
  EXPECT_EQ(uv1(5126, 0, std::vector<float>{0, 1, 1, 0, 0.5f, 0}, false), (V{{0, 1}, {1, 0}, {0.5f, 0}}));
  EXPECT_EQ(uv1(5126, 12, std::vector<float>{0, 1, 7, 1, 0, 7, 0.5f, 0}, false),
            (V{{0, 1}, {1, 0}, {0.5f, 0}}));
  EXPECT_EQ(uv1(5121, 4, std::vector<uint8_t>{0, 255, 9, 9, 255, 0, 9, 9, 51, 0}, true),
            (V{{0, 1}, {1, 0}, {0.2f, 0}}));
  EXPECT_EQ(uv1(5123, 0, std::vector<uint16_t>{0, 65535, 65535, 0, 13107, 0}, true),
            (V{{0, 1}, {1, 0}, {0.2f, 0}}));
  EXPECT_EQ(uv1(5120, 4, std::vector<int8_t>{0, 127, 9, 9, 127, -128, 9, 9, -127, 0}, true),
            (V{{0, 1}, {1, -1}, {-1, 0}}));
  EXPECT_EQ(uv1(5122, 0, std::vector<int16_t>{0, 32767, 32767, -32768, -32767, 0}, true),
            (V{{0, 1}, {1, -1}, {-1, 0}}));
  // KHR_mesh_quantization: integers that are not normalised keep their value.
  EXPECT_EQ(uv1(5123, 0, std::vector<uint16_t>{0, 7, 300, 0, 2, 0}, false), (V{{0, 7}, {300, 0}, {2, 0}}));
  EXPECT_EQ(uv1(5120, 4, std::vector<int8_t>{0, -7, 9, 9, 100, 0, 9, 9, 2, 0}, false),
            (V{{0, -7}, {100, 0}, {2, 0}}));
}

TEST(Meshes, QuantizedPositionsAndNormals) {
  GltfBuilder b;
  b.root["extensionsUsed"] = b.root["extensionsRequired"] = {"KHR_mesh_quantization"};
  json p;
  const std::vector<int16_t> positions{0, 0, 0, 77, 1000, 0, 0, 77, 0, 1000, 0, 77};
  p["attributes"]["POSITION"] = b.accessor(b.view(positions, 8), 5122, 3, "VEC3");
  const std::vector<int8_t> normals{0, 0, 127, 0, 0, 0, 100, 0, 0, 0, 127, 0};
  p["attributes"]["NORMAL"] = b.accessor(b.view(normals, 4), 5120, 3, "VEC3");
  b.root["accessors"][1]["normalized"] = true;
  b.node({{"mesh", b.mesh(p)}, {"scale", {0.001, 0.001, 0.001}}});
  const ImportResult r = imported(b);
  EXPECT_EQ(r.scene.meshes.at(0).positions[1], Vec3(1000, 0, 0));
  EXPECT_NEAR(transform_point(r.scene.instances.at(0).to_world, Vec3(1000, 0, 0)).x, 1.0f, 1e-6f);
  for (const Vec3& n : r.scene.meshes[0].normals) EXPECT_EQ(n, Vec3(0, 0, 1));
}

TEST(Meshes, SparseAccessors) {
  GltfBuilder b;
  const int base = b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const int indices = b.view(std::vector<uint16_t>{1}), values = b.view(std::vector<float>{5, 0, 0});
  b.root["accessors"][base]["sparse"] = {{"count", 1},
                                         {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                                         {"values", {{"bufferView", values}}}};
  // Without a buffer view the dense values are zeros.
  const int zeros = b.vec3({});
  b.root["accessors"][zeros].erase("bufferView");
  b.root["accessors"][zeros]["count"] = 3;
  const int all = b.view(std::vector<uint8_t>{0, 1, 2}),
            up = b.view(std::vector<float>{0, 1, 0, 0, 1, 0, 0, 1, 0});
  b.root["accessors"][zeros]["sparse"] = {{"count", 3},
                                          {"indices", {{"bufferView", all}, {"componentType", 5121}}},
                                          {"values", {{"bufferView", up}}}};
  b.node({{"mesh", b.mesh({{"attributes", {{"POSITION", base}, {"NORMAL", zeros}}}})}});
  const Mesh mesh = imported(b).scene.meshes.at(0);
  EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {5, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.normals[2], Vec3(0, 1, 0));

  b.root["accessors"][base]["sparse"]["count"] = 4;
  EXPECT_SAYS(refused(b),
              "accessor 0: 4 sparse values for 3 elements (attribute POSITION of mesh 0 primitive 0)");
  b.root["accessors"][base]["sparse"]["count"] = 1;
  b.buffer[b.root["bufferViews"][indices]["byteOffset"].get<size_t>()] = std::byte{3};
  EXPECT_SAYS(refused(b), "accessor 0: sparse index 0 is 3, there are 3 elements");
}

TEST(Meshes, ColoursOfThreeAndFourComponents) {
  const auto colors = [](int type, const char* shape, int accessor_components, const auto& data) {
    GltfBuilder b;
    const int position = b.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0});
    const int accessor = b.accessor(b.view(data, accessor_components), type, 3, shape);
    b.root["accessors"][accessor]["normalized"] = true;
    b.node({{"mesh", b.mesh({{"attributes", {{"POSITION", position}, {"COLOR_0", accessor}}}})}});
    return imported(b).scene.meshes.at(0).colors;
  };
  const auto rgb = colors(5121, "VEC3", 4, std::vector<uint8_t>{255, 0, 51, 9, 0, 0, 0, 9, 255, 255, 255, 9});
  ASSERT_EQ(rgb.size(), 3u);
  EXPECT_EQ(rgb[0], Vec4(1, 0, 0.2f, 1));
  const auto rgba =
      colors(5123, "VEC4", 0, std::vector<uint16_t>{65535, 0, 0, 13107, 0, 0, 0, 0, 0, 0, 0, 0});
  ASSERT_EQ(rgba.size(), 3u);
  EXPECT_EQ(rgba[0], Vec4(1, 0, 0, 0.2f));
  EXPECT_TRUE(colors(5126, "VEC3", 0, std::vector<float>(9, 1.0f)).empty()) << "white colours say nothing";
}

TEST(Meshes, BadPositionsAndIndicesAreNamed) {
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    Quad q;
    q.b.root["accessors"] = json::array();
    q.primitive["attributes"]["POSITION"] = q.b.vec3({0, 0, 0, 1, 0, 0, 1, bad, 0, 0, 1, 0});
    q.primitive.erase("indices");
    q.done().root["meshes"][0]["name"] = "wall";
    EXPECT_SAYS(refused(q.b), "x.glb: mesh 0 'wall' primitive 0: the position of vertex 2 is not finite");
  }
  Quad q;
  q.indices(std::vector<uint16_t>{0, 1, 2, 0, 2, 4}, 5123);
  EXPECT_SAYS(refused(q.done()), "x.glb: mesh 0 primitive 0: index 5 is 4, out of range of its 4 vertices");
}

TEST(Meshes, AccessorsMustFitTheirBuffers) {
  const auto message = [](const char* table, const char* key, const json& value) {
    Quad q;
    q.done().root[table][0][key] = value;
    return refused(q.b);
  };
  EXPECT_SAYS(message("accessors", "count", 5),
              "x.glb: accessor 0: 5 elements of 12 bytes, 12 bytes apart from byte 0, "
              "do not fit in buffer view 0 of 48 bytes");
  EXPECT_SAYS(message("accessors", "count", 18446744073709551615ull), "elements are too many");
  EXPECT_SAYS(message("accessors", "count", 4294967295ull), "do not fit");
  for (const json& bad : {json(-4), json(-4.0), json(0.5), json("4"), json(1e300)}) {
    EXPECT_SAYS(message("accessors", "byteOffset", bad), "accessor 0: byteOffset is " + bad.dump());
    EXPECT_SAYS(message("bufferViews", "byteOffset", bad), "buffer view 0: byteOffset is " + bad.dump());
    EXPECT_SAYS(message("bufferViews", "byteLength", bad), "not a whole number of at least 0");
  }
  EXPECT_SAYS(message("accessors", "byteOffset", 4), "do not fit");
  EXPECT_SAYS(message("accessors", "byteOffset", 18446744073709551615ull), "do not fit");
  EXPECT_SAYS(message("accessors", "bufferView", 9), "buffer view 9 does not exist, there are 2");
  EXPECT_SAYS(message("accessors", "componentType", 5130),
              "accessor 0: component type 5130 is not supported");
  EXPECT_SAYS(message("accessors", "type", "VEC2"), "attribute POSITION has 2 components");
  EXPECT_SAYS(message("accessors", "type", "MAT4"), "accessor 0: 16 components where 1 to 4 are expected");
  EXPECT_SAYS(message("bufferViews", "byteLength", 1000),
              "buffer view 0: bytes 0 + 1000 do not fit in buffer 0 of 60 bytes");
  EXPECT_SAYS(message("bufferViews", "byteOffset", 18446744073709551615ull), "do not fit");
  EXPECT_SAYS(message("bufferViews", "buffer", 3), "buffer view 0: buffer 3 does not exist, there are 1");
  EXPECT_SAYS(message("bufferViews", "byteStride", 4),
              "accessor 0: byteStride 4 is less than the 12 bytes of an element");
  Quad q;
  q.primitive["attributes"]["NORMAL"] = q.b.vec3({0, 0, 1});
  EXPECT_SAYS(refused(q.done()), "mesh 0 primitive 0: attribute NORMAL has 1 elements for 4 vertices");
  Quad missing;
  missing.primitive["attributes"]["NORMAL"] = 77;
  EXPECT_SAYS(refused(missing.done()),
              "accessor 77 does not exist, there are 2 (attribute NORMAL of mesh 0 primitive 0)");
  Quad material;
  material.primitive["material"] = 2;
  EXPECT_SAYS(refused(material.done()), "mesh 0 primitive 0: material 2 does not exist, there are 0");
}

TEST(Meshes, FlatTrianglesAndEmptyMeshesAreSkippedAndCounted) {
  Quad q;
  q.indices(std::vector<uint16_t>{0, 1, 1, 0, 1, 2, 0, 2, 3, 3, 3, 3}, 5123);
  q.b.node({{"mesh", q.b.mesh({{"attributes", json::object()}})}});
  q.b.node({{"mesh", q.b.mesh({{"attributes", {{"POSITION", q.b.vec3({1, 1, 1, 1, 1, 1, 1, 1, 1})}}}})}});
  const int line = q.b.mesh({{"attributes", {{"POSITION", q.b.vec3({0, 0, 0, 1, 1, 1})}}}, {"mode", 1}});
  q.b.node({{"mesh", line}});
  const ImportResult r = imported(q.done());
  ASSERT_EQ(r.scene.meshes.size(), 1u);
  EXPECT_EQ(r.scene.meshes[0].source_triangle, (std::vector<uint32_t>{1, 2}));
  EXPECT_SAYS(test::note_with(r, "without area"), "triangles without area are left out: 3, in 2 primitives");
  EXPECT_SAYS(test::note_with(r, "no triangle"), "in 2 primitives: mesh 0 primitive 0, mesh 1 primitive 0");
  EXPECT_SAYS(test::note_with(r, "points and lines"), "in 1 primitive: mesh 2 primitive 0");
}

TEST(Meshes, ASceneOfNothingIsRefused) {
  GltfBuilder b;
  EXPECT_SAYS(refused(b), "x.glb: the scene has no triangles to bake");
}

TEST(Meshes, OnlyWhatIsNeededIsKept) {
  Quad q;
  for (const char* name : {"TEXCOORD_0", "TEXCOORD_1"})
    q.primitive["attributes"][name] = q.b.vec2({0, 0, 1, 0, 1, 1, 0, 1});
  const Mesh plain = imported(q.done()).scene.meshes.at(0);
  EXPECT_TRUE(plain.uv[0].empty()) << "no texture reads it";
  EXPECT_EQ(plain.uv[1].size(), plain.positions.size());
}

TEST(Meshes, InstancesShareAMesh) {
  Quad q;
  q.done();
  q.b.node({{"mesh", 0}, {"translation", {5, 0, 0}}});
  const Scene scene = imported(q.b).scene;
  EXPECT_EQ(scene.meshes.size(), 1u);
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(scene.instances[1].to_world[3], Vec3(5, 0, 0));
}

TEST(Meshes, UnreadablePrimitiveIsNotPassedOver) {
  Quad q;
  q.primitive.erase("attributes");
  EXPECT_SAYS(refused(q.done()), "'attributes' property is missing in Primitive");
  Quad mode;
  mode.primitive["mode"] = 9;
  EXPECT_SAYS(refused(mode.done()), "mesh 0 primitive 0: mode 9 does not exist");
}

}  // namespace
}  // namespace kiln
