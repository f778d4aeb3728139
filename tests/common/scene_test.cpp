#include <random>

#include "common/scene/prepared.h"
#include "common/scene/scale.h"

namespace kiln {
namespace {

Scene small_scene() {
  Scene s;
  Mesh m;
  m.name = "quad";
  m.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  m.normals.assign(4, Vec3(0, 0, 1));
  m.uv[1] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  m.triangles = {{0, 1, 2}, {0, 2, 3}};
  m.source_triangle = {0, 1};
  s.meshes.push_back(m);
  s.materials.push_back(
      {"metallic_roughness", "white", Mat4x3(1.0f), {{"base_color", {1, 1, 1, 1}, "", {}}}});
  s.lights.push_back({"point", "lamp", Mat4x3(1.0f), {{"intensity", {10}, "", {}}}});
  Texture t;
  t.name = "grey";
  t.width = 2, t.height = 1, t.channels = 1;
  t.texels = {std::byte{128}, std::byte{64}};
  s.textures.push_back(t);
  s.instances.push_back({0, 0, Mat4x3(1.0f), "node", 0, 0, 0});
  return s;
}

TEST(Prepared, RoundTripKeepsTheId) {
  ChunkStore store;
  const Digest id = write_scene(small_scene(), store);
  EXPECT_EQ(store.size(), 3u);
  const auto back = read_scene(*store.find(id), [&](const Digest& d) { return store.find(d); });
  ASSERT_TRUE(back) << back.error().message;
  ChunkStore again;
  EXPECT_EQ(write_scene(*back, again), id);
}

TEST(Prepared, EqualChunksAreStoredOnce) {
  Scene s = small_scene();
  s.meshes.push_back(s.meshes[0]);
  s.instances.push_back({1, 0, Mat4x3(1.0f), "twin", 1, 0, 0});
  ChunkStore store;
  write_scene(s, store);
  EXPECT_EQ(store.size(), 3u);
}

TEST(Prepared, DamagedChunksFailAndNeverCrash) {
  ChunkStore store;
  const Digest id = write_scene(small_scene(), store);
  std::mt19937 random(7);
  const Bytes original = *store.find(id);
  for (int round = 0; round < 3000; ++round) {
    Bytes bytes = original;
    if (round % 3 == 0) bytes.resize(random() % bytes.size());
    for (int k = 0; k < 3 && !bytes.empty(); ++k) bytes[random() % bytes.size()] = std::byte(random() & 255);
    (void)read_scene(bytes, [&](const Digest& d) { return store.find(d); });
  }
}

TEST(Prepared, IndexOutOfRangeIsRefused) {
  Scene s = small_scene();
  s.meshes[0].triangles[1].z = 4;
  const Status status = check_scene(s);
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("quad"), std::string::npos);
}

TEST(Image, ReduceKeepsTheMean) {
  Texture t;
  t.width = 8, t.height = 4, t.channels = 1, t.format = TexelFormat::kFloat32;
  t.texels.resize(8 * 4 * 4);
  auto* f = reinterpret_cast<float*>(t.texels.data());
  double sum = 0;
  for (int i = 0; i < 32; ++i) sum += f[i] = static_cast<float>(i * i % 11);
  const Texture small = reduce_texture(t, 2);
  EXPECT_EQ(small.width, 2u);
  EXPECT_EQ(small.height, 1u);
  const auto* g = reinterpret_cast<const float*>(small.texels.data());
  EXPECT_NEAR((g[0] + g[1]) / 2, sum / 32, 1e-5);
}

TEST(Image, SrgbRoundTrip) {
  for (int i = 0; i < 256; ++i) EXPECT_EQ(std::lround(255 * linear_to_srgb(srgb_to_linear(i / 255.0f))), i);
}

TEST(Image, SrgbBytesAreThoseOfTheFormula) {
  for (int i = 0; i < 256; ++i)
    EXPECT_EQ(srgb8_to_linear(static_cast<uint8_t>(i)), srgb_to_linear(static_cast<float>(i) / 255.0f)) << i;
  const auto byte = [](float linear) { return std::lround(255.0f * linear_to_srgb(linear)); };
  uint8_t last = 0;
  const uint32_t one = std::bit_cast<uint32_t>(1.0f), darkest = std::bit_cast<uint32_t>(1e-5f);
  for (uint32_t bits = darkest; bits <= one; bits += 101) {  // a millionth apart at most
    const auto linear = std::bit_cast<float>(bits);
    const uint8_t now = linear_to_srgb8(linear);
    ASSERT_EQ(now, byte(linear)) << linear;
    ASSERT_TRUE(now == last || now == last + 1) << linear;
    last = now;
  }
  EXPECT_EQ(linear_to_srgb8(1.0f), 255);
  EXPECT_EQ(linear_to_srgb8(1e30f), 255);
  EXPECT_EQ(linear_to_srgb8(0.0f), 0);
  EXPECT_EQ(linear_to_srgb8(-1.0f), 0);
  EXPECT_EQ(linear_to_srgb8(std::numeric_limits<float>::quiet_NaN()), 0);
}

Scene square_of(float side) {
  Scene scene;
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {side, 0, 0}, {side, 0, side}, {0, 0, side}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes.push_back(std::move(mesh));
  scene.instances.emplace_back();
  return scene;
}

TEST(Scale, IsOfTheWholeScene) {
  Scene scene = square_of(3);
  scene.instances.emplace_back();
  scene.instances.back().to_world[3] = Vec3(7, 0, 0);
  const SceneScale scale = measure_scale(scene);
  EXPECT_EQ(scale.widest_m, 10);
  EXPECT_EQ(scale.area_m2, 18);
  EXPECT_EQ(measure_scale(Scene()).widest_m, 0);
}

TEST(Scale, HundredsOfMetresAndMillimetresAreDoubted) {
  const auto doubt = [](float side, double density) {
    return doubt_density(measure_scale(square_of(side)), density);
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(has(doubt(560, 8), "560 m wide; if it is 5.6 m in centimetres")) << doubt(560, 8);
  EXPECT_TRUE(has(doubt(560, 8), "about 20.1 million texels; --texels-per-metre 1 makes about 0.31 million"));
  EXPECT_EQ(doubt(560, 2), "") << "a field of that size at a density that fits it";
  EXPECT_EQ(doubt(90, 40), "") << "a large hall at a high density";
  EXPECT_TRUE(has(doubt(0.005f, 8), "the scene is 5 mm wide; if it should be 5 m")) << doubt(0.005f, 8);
  EXPECT_TRUE(has(doubt(0.005f, 8), "--texels-per-metre 50000 makes about 0.06"));
  EXPECT_EQ(doubt(0.05f, 2000), "") << "a jewel at its density";
  EXPECT_EQ(doubt(5, 8), "");
}

}  // namespace
}  // namespace kiln
