// Classes of alpha by triangle, and normal maps, on small meshes.
#include <cstring>

#include "common/math/sequence.h"
#include "common/math/warp.h"
#include "worker/surface/surfaces.h"

namespace kiln {
namespace {

Property numbers(std::string name, std::vector<double> v) {
  return {std::move(name), std::move(v), "", {}};
}

// Triangles of random coordinates in a texture whose left half is opaque and whose right is clear.
Scene random_triangles(Wrap wrap, const char* mode, float size, bool nearest) {
  Scene s;
  Texture t;
  t.name = "halves", t.width = 32, t.height = 16, t.channels = 4, t.wrap_s = t.wrap_t = wrap,
  t.nearest = nearest;
  for (uint32_t i = 0; i < t.width * t.height; ++i)
    for (int c = 0; c < 4; ++c) t.texels.push_back(std::byte{static_cast<uint8_t>(i % 32 < 16 ? 255 : 0)});
  s.textures.push_back(t);
  Record m{"metallic_roughness", "leaf", Mat4x3(1.0f), {}};
  Property texture{"base_color_texture", {}, "", {}};
  texture.texture = {0, 0, {0.8f, 0.3f, 0.1f, -0.2f, 1.1f, 0.4f}};
  m.properties = {texture, {"alpha_mode", {}, mode, {}}};
  s.materials.push_back(m);
  Mesh mesh;
  mesh.name = "leaves";
  uint64_t state = 7;
  const auto next = [&] { return unit_float(static_cast<uint32_t>(mix_bits(++state) >> 32)); };
  for (uint32_t i = 0; i < 400; ++i) {
    const Vec2 at(6 * next() - 3, 6 * next() - 3);
    for (uint32_t k = 0; k < 3; ++k) {
      mesh.positions.push_back({next(), next(), next()});
      mesh.normals.push_back({0, 1, 0});
      mesh.uv[0].push_back(at + Vec2(next(), next()) * size);
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    mesh.source_triangle.push_back(i);
  }
  s.meshes.push_back(std::move(mesh));
  s.instances.push_back({0, 0, Mat4x3(1.0f), "leaves", 0, 0, 0});
  return s;
}

TEST(Cover, NoPointOfATriangleContradictsItsClass) {
  size_t of[3] = {};
  for (const Wrap wrap : {Wrap::kRepeat, Wrap::kClamp, Wrap::kMirror})
    for (const char* mode : {"mask", "blend"})
      for (const float size : {0.05f, 0.4f, 3.0f})
        for (const bool nearest : {false, true}) {
          std::vector<std::string> warnings;
          const auto s = Surfaces::create(random_triangles(wrap, mode, size, nearest), warnings).value();
          for (uint32_t t = 0; t < 400; ++t) {
            const Cover cover = s->cover(0, t);
            ++of[static_cast<int>(cover)];
            for (uint32_t i = 0; i < 100 && cover != Cover::kMixed; ++i) {
              // Corners and edges too: half of the points lie on them.
              Vec2 b = uniform_triangle(SampleStream(3, t, i).pair(0));
              if (i % 2) b.x = 0;
              if (i % 8 == 7) b.y = static_cast<float>(i % 16 == 7);
              const float opacity = s->opacity(0, t, b.x, b.y);
              if (cover == Cover::kClear)
                ASSERT_EQ(opacity, 0.0f) << t;
              else
                ASSERT_GE(opacity, 1.0f - 0x1p-20f) << t;
            }
          }
        }
  // The classes are of use: small triangles mostly lie in one half.
  EXPECT_GT(of[0], 3000u);
  EXPECT_GT(of[1], 3000u);
  EXPECT_GT(of[2], 1000u);
}

TEST(Cover, OpaqueMaterialsNeedNoTest) {
  std::vector<std::string> warnings;
  const auto s = Surfaces::create(random_triangles(Wrap::kRepeat, "opaque", 3.0f, false), warnings).value();
  EXPECT_FALSE(s->has_alpha(0));
  EXPECT_EQ(s->cover(0, 17), Cover::kOpaque);
}

// One triangle in the plane z = 0 with du and dv as given; the map's normal is (0.6, 0, 0.8) or (0, 0.6,
// 0.8).
Vec3 mapped(const Vec2& du, const Vec2& dv, bool green, const Mat4x3& to_world = Mat4x3(1.0f)) {
  Scene s;
  Texture t;
  t.name = "tilt", t.width = t.height = 1, t.channels = 3, t.format = TexelFormat::kFloat32;
  const float c[3] = {green ? 0.5f : 0.8f, green ? 0.8f : 0.5f, 0.9f};
  t.texels.resize(sizeof c);
  std::memcpy(t.texels.data(), c, sizeof c);
  s.textures.push_back(t);
  Property map{"normal_texture", {}, "", {}};
  map.texture.texture = 0;
  s.materials.push_back({"metallic_roughness", "m", Mat4x3(1.0f), {map, numbers("metallic", {0})}});
  Mesh m;
  m.name = "t";
  m.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  m.normals.assign(3, {0, 0, 1});
  m.uv[0] = {{0.1f, 0.2f}, Vec2(0.1f, 0.2f) + Vec2(du.x, dv.x), Vec2(0.1f, 0.2f) + Vec2(du.y, dv.y)};
  m.triangles = {{0, 1, 2}};
  m.source_triangle = {0};
  s.meshes.push_back(m);
  for (int i = 0; i < 2; ++i) s.instances.push_back({0, 0, to_world, "t", 0, 0, 0});  // shared: not flattened
  std::vector<std::string> warnings;
  const auto surfaces = Surfaces::create(std::move(s), warnings).value();
  return surfaces->mapped_normal(0, 0, surfaces->at(0, 0, 0.25f, 0.25f));
}

void expect_near(const Vec3& a, const Vec3& b) {
  EXPECT_LE(length(a - b), 1e-5f) << a.x << " " << a.y << " " << a.z;
}

TEST(NormalMaps, RedIsAlongUGreenAgainstV) {
  // u to the right, v down as images lie: green is up.
  expect_near(mapped({1, 0}, {0, -1}, false), {0.6f, 0, 0.8f});
  expect_near(mapped({1, 0}, {0, -1}, true), {0, 0.6f, 0.8f});
  // Mirrored in u: red to the left, green stays up.
  expect_near(mapped({-1, 0}, {0, -1}, false), {-0.6f, 0, 0.8f});
  expect_near(mapped({-1, 0}, {0, -1}, true), {0, 0.6f, 0.8f});
  // Turned by a quarter: u upwards, v to the right.
  expect_near(mapped({0, 1}, {1, 0}, false), {0, 0.6f, 0.8f});
  expect_near(mapped({0, 1}, {1, 0}, true), {-0.6f, 0, 0.8f});
  // No area in the texture: no frame.
  expect_near(mapped({1, 1}, {1, 1}, false) * 0.0f, Vec3(0.0f));
}

TEST(NormalMaps, TurnAndMirrorWithTheInstance) {
  const Mat4x3 turned(Vec3(0, 0, -1), Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(5, 6, 7));  // x to -z, z to x
  expect_near(mapped({1, 0}, {0, -1}, false, turned), {0.8f, 0, -0.6f});
  const Mat4x3 mirrored(Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0));
  expect_near(mapped({1, 0}, {0, -1}, false, mirrored), {-0.6f, 0, 0.8f});
  expect_near(mapped({1, 0}, {0, -1}, true, mirrored), {0, 0.6f, 0.8f});
}

}  // namespace
}  // namespace kiln
