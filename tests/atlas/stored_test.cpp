#include "common/atlas/atlas.h"
#include "tests/atlas/shapes.h"

namespace kiln {
namespace {
using namespace test;

Scene small_scene() {
  return scene_of({box(Vec3(1), Uv::kUnit), sphere(6, 1), plane(2, 1, Uv::kUnit)});
}

TEST(StoredAtlas, RoundTrip) {
  const Scene scene = small_scene();
  const Atlas atlas = *build_atlas(scene, pack_at(3));
  const Bytes bytes = write_atlas(atlas);
  const Atlas again = *read_atlas(bytes, scene);
  EXPECT_EQ(write_atlas(again), bytes);
  EXPECT_EQ(again.width, atlas.width);
  EXPECT_EQ(again.sites.texel, atlas.sites.texel);
  EXPECT_TRUE(again.owner.empty());
  for (uint32_t i = 0; i < atlas.sites.size(); ++i) {
    const SitePick a = pick_site(atlas, i, 0.7f), b = pick_site(again, i, 0.7f);
    EXPECT_EQ(a.triangle, b.triangle);
    EXPECT_EQ(a.b1, b.b1);
  }
}

// Whatever is accepted must be safe to use.
void use(const Atlas& atlas, const Scene& scene) {
  for (uint32_t i = 0; i < atlas.sites.size(); ++i) {
    const SitePick pick = pick_site(atlas, i, 0.99f);
    ASSERT_LT(pick.triangle, scene.meshes[scene.instances[pick.instance].mesh].triangles.size());
    ASSERT_TRUE(pick.b1 >= 0 && pick.b2 >= 0 && pick.b1 + pick.b2 <= 1 + 1e-6f);
  }
}

TEST(StoredAtlas, DamageIsRefusedOrHarmless) {
  const Scene scene = small_scene();
  const Bytes bytes = write_atlas(*build_atlas(scene, pack_at(2)));
  Random random(31);
  size_t refused = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    Bytes damaged = bytes;
    const int changes = 1 + trial % 3;
    for (int k = 0; k < changes; ++k) {
      const size_t word = random.below(static_cast<uint32_t>(bytes.size() / 4)) * 4;
      const uint32_t values[] = {0,          1,          ~0u,        0x7fffffff,
                                 0x80000000, 0x7fc00000, 0x7f800000, 1u << random.below(32)};
      const uint32_t value = values[random.below(8)];
      std::memcpy(&damaged[word], &value, 4);
    }
    if (trial % 10 == 0) damaged.resize(random.below(static_cast<uint32_t>(bytes.size())));
    const auto atlas = read_atlas(damaged, scene);
    if (atlas)
      use(*atlas, scene);
    else
      ++refused;
  }
  EXPECT_GT(refused, 1500u);
}

TEST(StoredAtlas, APointOfTwoTrianglesIsRefused) {
  const Scene scene = small_scene();
  Atlas atlas = *build_atlas(scene, pack_at(2));
  size_t i = 0;
  while (atlas.sites.first_word[i + 1] - atlas.sites.first_word[i] < 10) ++i;
  uint32_t* pairs = &atlas.sites.words[atlas.sites.first_word[i] + 2];
  for (int half = 0; half < 2; ++half) pairs[4 + half] |= pairs[half];
  EXPECT_FALSE(read_atlas(write_atlas(atlas), scene));
}

TEST(StoredAtlas, AnotherSceneIsRefused) {
  const Scene scene = small_scene();
  const Bytes bytes = write_atlas(*build_atlas(scene, pack_at(2)));
  EXPECT_FALSE(read_atlas(bytes, scene_of({box(Vec3(1), Uv::kUnit)})));
  EXPECT_FALSE(read_atlas({}, scene));
}

TEST(StoredAtlas, HugeSizesAreRefused) {  // width * height would wrap to 0
  const Scene scene = small_scene();
  Bytes bytes = write_atlas(*build_atlas(scene, pack_at(2)));
  const uint32_t side = 1u << 16;
  std::memcpy(&bytes[4], &side, 4);
  std::memcpy(&bytes[8], &side, 4);
  EXPECT_FALSE(read_atlas(bytes, scene));
}

}  // namespace
}  // namespace kiln
