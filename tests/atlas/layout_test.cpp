#include "common/atlas/atlas.h"
#include "common/raster/triangle2.h"
#include "tests/atlas/shapes.h"

namespace kiln {
namespace {
using namespace test;

bool mentions(const std::string& message, const std::string& part) {
  return message.find(part) != std::string::npos;
}

uint32_t placement_of(const Scene&, const Atlas& atlas, uint32_t instance, uint32_t triangle) {
  return atlas.instance_first_chart[instance] + atlas.of_instance(instance).chart_of_face[triangle];
}

Scene mixed_scene() {
  Scene scene = scene_of(
      {box({1, 2, 0.5f}, Uv::kUnit), sphere(20, 1), spiral(3, 24), soup(60, 9), plane(3, 2, Uv::kUnit)});
  scene.instances.push_back(instance(0, "box again", at({0, 5, 0})));
  Mat4x3 stretched = at({0, 9, 0});
  stretched[0] *= 7.0f;
  scene.instances.push_back(instance(0, "long box", stretched));
  Mat4x3 mirrored = at({0, 14, 0});
  mirrored[2] *= -1.0f;
  scene.instances.push_back(instance(1, "mirrored sphere", mirrored));
  return scene;
}

TEST(LayoutPack, EveryTexelABilinearLookupReachesIsOwned) {
  const Scene scene = mixed_scene();
  for (float density : {0.3f, 2.0f, 7.3f}) {
    const Atlas atlas = *build_atlas(scene, pack_at(density));
    Random random(21);
    for (uint32_t i = 0; i < scene.instances.size(); ++i) {
      const MeshCharts& charts = atlas.of_instance(i);
      for (uint32_t t = 0; t < charts.chart_of_face.size(); ++t) {
        const uint32_t p = placement_of(scene, atlas, i, t);
        const Triangle2 c = texel_triangle(charts, atlas.placements[p], t);
        for (int k = 0; k < 20; ++k) {
          double b1 = random.next(), b2 = random.next();
          if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
          const DVec2 at = c.c[0] + b1 * (c.c[1] - c.c[0]) + b2 * (c.c[2] - c.c[0]) - 0.5;
          const double x = std::floor(at.x), y = std::floor(at.y);
          for (int tap = 0; tap < 4; ++tap) {
            const double wx = tap & 1 ? at.x - x : x + 1 - at.x, wy = tap & 2 ? at.y - y : y + 1 - at.y;
            if (wx * wy < 1.0 / 256) continue;  // less than a texture unit's weights can tell
            const auto tx = static_cast<size_t>(x + (tap & 1)), ty = static_cast<size_t>(y + (tap >> 1));
            ASSERT_LT(tx, atlas.width);
            ASSERT_LT(ty, atlas.height);
            ASSERT_EQ(atlas.owner[(size_t{atlas.placements[p].page} * atlas.height + ty) * atlas.width + tx],
                      p + 1);
          }
        }
      }
    }
  }
}

TEST(LayoutPack, ChartBoxesLieOnTexelCentres) {
  const Scene scene = mixed_scene();
  const Atlas atlas = *build_atlas(scene, pack_at(5.7f));
  std::vector<DVec2> low(atlas.placements.size(), DVec2(1e9)), high(atlas.placements.size(), DVec2(-1e9));
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const MeshCharts& charts = atlas.of_instance(i);
    for (uint32_t t = 0; t < charts.chart_of_face.size(); ++t) {
      const uint32_t p = placement_of(scene, atlas, i, t);
      for (const DVec2& c : texel_triangle(charts, atlas.placements[p], t).c) {
        low[p] = glm::min(low[p], c);
        high[p] = glm::max(high[p], c);
      }
    }
  }
  for (size_t p = 0; p < low.size(); ++p)
    for (double side : {low[p].x, low[p].y, high[p].x, high[p].y})
      EXPECT_NEAR(side - 0.5, std::round(side - 0.5), 1e-3) << "placement " << p;
}

TEST(LayoutPack, DensityAndShapeFollowTheWorld) {
  Scene scene = scene_of({plane(4, 8, Uv::kUnit), plane(4, 8, Uv::kNone)});
  Mat4x3 stretched = at({0, 9, 0});
  stretched[0] *= 4.0f;
  scene.instances.push_back(instance(0, "stretched", stretched));
  const Atlas atlas = *build_atlas(scene, pack_at(4));
  const auto extent = [&](uint32_t i) {
    DVec2 low(1e9), high(-1e9);
    const MeshCharts& charts = atlas.of_instance(i);
    for (uint32_t t = 0; t < charts.chart_of_face.size(); ++t)
      for (const DVec2& c : texel_triangle(charts, atlas.placements[placement_of(scene, atlas, i, t)], t).c) {
        low = glm::min(low, c);
        high = glm::max(high, c);
      }
    const bool turned = atlas.placements[placement_of(scene, atlas, i, 0)].turned;
    return turned ? DVec2(high.y - low.y, high.x - low.x) : high - low;
  };
  for (uint32_t i : {0u, 1u}) {
    EXPECT_NEAR(extent(i).x, 32, 1e-3);
    EXPECT_NEAR(extent(i).y, 32, 1e-3);
  }
  EXPECT_NEAR(extent(2).x, 128, 1e-2);
  EXPECT_NEAR(extent(2).y, 32, 1e-2);
  EXPECT_EQ(atlas.charts[0].generated, false);
  EXPECT_EQ(atlas.charts[1].generated, true);
  EXPECT_EQ(atlas.statistics.generated_meshes, 1u);
}

TEST(LayoutPack, SitesBelongToTheOwnerOfTheirTexel) {
  const Scene scene = mixed_scene();
  const Atlas atlas = *build_atlas(scene, pack_at(6));
  uint64_t owned = 0;
  for (uint32_t owner : atlas.owner) owned += owner != 0;
  EXPECT_EQ(owned, atlas.statistics.mask_texels);
  for (size_t i = 0; i < atlas.sites.size(); ++i)
    for (uint32_t w = atlas.sites.first_word[i] + 2; w < atlas.sites.first_word[i + 1]; w += 4)
      ASSERT_EQ(atlas.owner[atlas.sites.texel[i]],
                placement_of(scene, atlas, atlas.sites.words[w + 2], atlas.sites.words[w + 3]) + 1);
}

TEST(LayoutPack, SameBytesForAnyNumberOfThreads) {
  const Scene scene = mixed_scene();
  AtlasSettings settings = pack_at(6);
  settings.threads = 1;
  const Atlas one = *build_atlas(scene, settings);
  for (unsigned threads : {2u, 5u}) {
    settings.threads = threads;
    const Atlas many = *build_atlas(scene, settings);
    EXPECT_EQ(write_atlas(one), write_atlas(many));
    EXPECT_EQ(one.owner, many.owner);
    EXPECT_EQ(one.warnings, many.warnings);
  }
}

TEST(LayoutPack, EqualInstancesShareMasks) {
  Scene scene;
  scene.meshes = {box(Vec3(1), Uv::kUnit)};
  for (int i = 0; i < 50; ++i) scene.instances.push_back(instance(0, "crate", at({float(i), 0, 0})));
  const Atlas atlas = *build_atlas(scene, pack_at(8));
  EXPECT_EQ(atlas.statistics.charts, 300u);
  EXPECT_LE(atlas.statistics.distinct_masks, 6u);
}

TEST(LayoutPack, SeveralPages) {
  const Scene scene = mixed_scene();
  AtlasSettings settings = pack_at(12);
  settings.max_page_size = 96;
  const Atlas atlas = *build_atlas(scene, settings);
  EXPECT_GT(atlas.pages, 1u);
  EXPECT_LE(std::max(atlas.width, atlas.height), 96u);
  uint32_t last_page = 0;
  for (uint32_t texel : atlas.sites.texel)
    last_page = std::max(last_page, texel / (atlas.width * atlas.height));
  EXPECT_EQ(last_page, atlas.pages - 1);
}

TEST(LayoutPack, ADensityThatCannotFitNamesOneThatDoes) {
  Scene scene;
  scene.meshes = {plane(1, 100, Uv::kUnit)};
  for (int i = 0; i < 300; ++i) scene.instances.push_back(instance(0, "hall", at({0, float(i), 0})));
  AtlasSettings settings = pack_at(50);
  settings.max_page_size = 512;
  const auto atlas = build_atlas(scene, settings);
  ASSERT_FALSE(atlas);
  EXPECT_EQ(atlas.error().kind, ErrorKind::kInvalidInput);
  EXPECT_TRUE(mentions(atlas.error().message, "50 texels per metre")) << atlas.error().message;
  const size_t at = atlas.error().message.find("texels; ");
  ASSERT_NE(at, std::string::npos) << atlas.error().message;
  settings.texels_per_metre = std::stof(atlas.error().message.substr(at + 8));
  EXPECT_GT(settings.texels_per_metre, 1.0f);
  const auto fits = build_atlas(scene, settings);
  EXPECT_TRUE(fits) << fits.error().message;
}

TEST(LayoutPack, AChartLargerThanAPageIsMadeSmallerWithAWarning) {
  AtlasSettings settings = pack_at(4);
  settings.max_page_size = 256;
  const Atlas atlas = *build_atlas(scene_of({plane(4, 1000, Uv::kUnit)}), settings);
  EXPECT_EQ(atlas.width, 256u);
  ASSERT_EQ(atlas.warnings.size(), 1u);
  EXPECT_TRUE(mentions(atlas.warnings[0], "'plane 0'")) << atlas.warnings[0];
}

TEST(LayoutPack, AMeshWithUnusableCoordinatesIsNamed) {
  Mesh flat = plane(2, 1, Uv::kUnit);
  flat.name = "crumpled";
  for (Vec2& uv : flat.uv[1]) uv = Vec2(0.5f);
  const Atlas atlas = *build_atlas(scene_of({flat}), pack_at(4));
  EXPECT_TRUE(atlas.warnings.empty());
  ASSERT_EQ(atlas.notes.size(), 1u);
  EXPECT_TRUE(mentions(atlas.notes[0], "'crumpled'")) << atlas.notes[0];
  EXPECT_TRUE(atlas.charts[0].generated);
}

TEST(LayoutPack, DegenerateAndEmptyInput) {
  Mesh line;
  line.name = "line";
  line.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  line.normals.assign(3, {0, 1, 0});
  line.triangles = {{0, 1, 2}, {1, 1, 1}};
  for (const Scene& scene : {Scene{}, scene_of({line}), scene_of({Mesh{}})})
    for (const AtlasSettings& settings : {pack_at(4), AtlasSettings{}}) {
      const auto atlas = build_atlas(scene, settings);
      ASSERT_FALSE(atlas);
      EXPECT_EQ(atlas.error().kind, ErrorKind::kInvalidInput);
      EXPECT_TRUE(mentions(atlas.error().message, "no texel is covered")) << atlas.error().message;
    }
  EXPECT_TRUE(build_atlas(scene_of({line, plane(2, 1, Uv::kUnit), Mesh{}}), pack_at(4)));
}

TEST(LayoutPack, BadSettingsAreRefused) {
  const Scene scene = mixed_scene();
  for (float density : {0.0f, -1.0f, NAN, INFINITY}) EXPECT_FALSE(build_atlas(scene, pack_at(density)));
  EXPECT_FALSE(build_atlas(scene, file_atlas(0)));
  EXPECT_FALSE(build_atlas(scene, pack_at(1e20f)));
  EXPECT_TRUE(build_atlas(scene, pack_at(1e-20f)));  // every chart at its least size
}

// Two planes side by side in one atlas.
Scene two_halves() {
  Mesh left = plane(5, 2, Uv::kUnit), right = left;
  for (Vec2& uv : left.uv[1]) uv.x *= 0.5f;
  for (Vec2& uv : right.uv[1]) uv.x = 0.5f + 0.5f * uv.x;
  Scene scene = scene_of({left, right});
  scene.instances[0].name = "left";
  scene.instances[1].name = "right";
  return scene;
}

TEST(LayoutAtlas, IsTakenAsItIs) {
  for (AtlasSettings settings : {file_atlas(48), AtlasSettings{}}) {
    settings.width = 48;
    settings.height = 32;
    const Atlas atlas = *build_atlas(two_halves(), settings);
    EXPECT_FALSE(atlas.packed);
    EXPECT_TRUE(atlas.warnings.empty());
    EXPECT_EQ(atlas.sites.size(), 48u * 32u);
    for (const ChartPlacement& p : atlas.placements) {
      EXPECT_EQ(p.scale, Vec2(48, 32));
      EXPECT_EQ(p.offset, Vec2(0, 0));
    }
    for (uint32_t texel = 0; texel < 48 * 32; ++texel)
      EXPECT_EQ(atlas.owner[texel], texel % 48 < 24 ? 1u : 2u);
  }
}

// Refused under kAtlas with these words; packed with a note that holds them under kAuto.
void expect_refused(const Scene& scene, const std::vector<std::string>& words) {
  AtlasSettings settings = file_atlas(64);
  const auto atlas = build_atlas(scene, settings);
  ASSERT_FALSE(atlas);
  EXPECT_EQ(atlas.error().kind, ErrorKind::kInvalidInput);
  settings.layout = AtlasSettings::Layout::kAuto;
  const auto packed = build_atlas(scene, settings);
  ASSERT_TRUE(packed);
  EXPECT_TRUE(packed->packed);
  ASSERT_FALSE(packed->notes.empty());
  for (const std::string& word : words) {
    EXPECT_TRUE(mentions(atlas.error().message, word)) << word << " in: " << atlas.error().message;
    EXPECT_TRUE(mentions(packed->notes[0], word)) << packed->notes[0];
  }
}

TEST(LayoutAtlas, RefusesAndNames) {
  Scene absent = two_halves();
  absent.meshes[1].uv[1].clear();
  expect_refused(absent, {"no TEXCOORD_1", "'right'"});
  Scene outside = two_halves();
  for (Vec2& uv : outside.meshes[1].uv[1]) uv.x += 0.01f;
  expect_refused(outside, {"[0, 1]", "'right'"});
  Scene overlapping = two_halves();
  for (Vec2& uv : overlapping.meshes[1].uv[1]) uv.x -= 0.125f;
  expect_refused(overlapping, {"'left' and 'right'", "texel (", "64 of its 64 points"});
  Scene twice = two_halves();
  twice.instances.push_back(instance(0, "left twin", at({0, 8, 0})));
  expect_refused(twice, {"'left' and 'left twin'"});
  Scene folded = two_halves();
  for (Vec2& uv : folded.meshes[0].uv[1]) uv.x = std::abs(uv.x - 0.2f);
  expect_refused(folded, {"'left' covers itself"});
}

TEST(LayoutAtlas, ASmallObjectInsideAnotherIsFound) {
  Scene scene = two_halves();
  Mesh decal = plane(1, 1, Uv::kUnit);
  for (Vec2& uv : decal.uv[1]) uv = Vec2(0.7f) + 0.02f * uv;
  scene.meshes.push_back(decal);
  scene.instances.push_back(instance(2, "decal", at({0, 1, 0})));
  expect_refused(scene, {"'right' and 'decal'"});
}

// What gets no texels needs no coordinates, and lies on nobody.
TEST(LayoutAtlas, WhatDoesNotReceiveIsLeftOut) {
  Scene scene = two_halves();
  Mesh bare = plane(1, 1, Uv::kNone);
  scene.meshes.push_back(bare);
  scene.instances.push_back(instance(2, "bare", at({0, 1, 0})));
  EXPECT_FALSE(build_atlas(scene, file_atlas(64)));
  scene.instances[2].receive = false;
  scene.instances.push_back(instance(0, "left twin", at({0, 8, 0})));
  scene.instances[3].receive = false;
  const Atlas with = *build_atlas(scene, file_atlas(64)),
              without = *build_atlas(two_halves(), file_atlas(64));
  EXPECT_EQ(with.owner, without.owner);
  EXPECT_EQ(with.placements.size(), without.placements.size());
  EXPECT_FALSE(with.packed);
  EXPECT_FALSE(with.receives(2) || with.receives(3));
  EXPECT_TRUE(with.receives(0) && with.receives(1));
  const auto back = read_atlas(write_atlas(with), scene);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_FALSE(back->receives(3));
}

TEST(LayoutAtlas, AnObjectWithoutAnyAreaGetsNoTexelsAndAWarning) {
  Scene scene = two_halves();
  Mesh bare = plane(1, 1, Uv::kUnit);
  for (Vec2& uv : bare.uv[1]) uv = Vec2(0.5f);
  scene.meshes.push_back(bare);
  scene.instances.push_back(instance(2, "bare", at({0, 1, 0})));
  for (AtlasSettings settings : {file_atlas(64), AtlasSettings{}}) {
    settings.width = settings.height = 64;
    const auto atlas = build_atlas(scene, settings);
    ASSERT_TRUE(atlas) << atlas.error().message;
    EXPECT_FALSE(atlas->packed);
    EXPECT_FALSE(atlas->receives(2));
    EXPECT_EQ(atlas->owner, build_atlas(two_halves(), file_atlas(64))->owner);
    ASSERT_EQ(atlas->warnings.size(), 1u);
    EXPECT_TRUE(mentions(atlas->warnings[0], "they get no texels: 'bare'")) << atlas->warnings[0];
  }
}

TEST(LayoutPack, WhatDoesNotReceiveHasNoCharts) {
  Scene scene = mixed_scene();
  const size_t all = build_atlas(scene, pack_at(2))->placements.size();
  const size_t last = scene.instances.size() - 1;
  size_t gone = 0;
  for (const size_t i : {size_t{0}, last}) {
    gone += build_atlas(scene, pack_at(2))->of_instance(i).chart_count;
    scene.instances[i].receive = false;
  }
  const Atlas atlas = *build_atlas(scene, pack_at(2));
  EXPECT_FALSE(atlas.receives(0) || atlas.receives(last));
  EXPECT_EQ(atlas.instance_first_chart[1], 0u);
  EXPECT_LT(atlas.placements.size(), all);
  EXPECT_GT(gone, 0u);
  for (uint32_t site = 0; site < atlas.sites.size(); ++site) {
    const uint32_t instance = pick_site(atlas, site, 0.5f).instance;
    EXPECT_TRUE(instance != 0 && instance != last);
  }
  EXPECT_TRUE(read_atlas(write_atlas(atlas), scene));
}

TEST(LayoutAtlas, ContactIsNotOverlap) {
  Scene scene = two_halves();
  for (Vec2& uv : scene.meshes[1].uv[1]) uv.x -= 5e-4f;  // 0.032 of a texel: two points of its 64
  const auto atlas = build_atlas(scene, file_atlas(64));
  ASSERT_TRUE(atlas) << atlas.error().message;
  EXPECT_EQ(atlas->statistics.overlapped_points, 2u * 64u);
  ASSERT_EQ(atlas->warnings.size(), 1u);
  EXPECT_TRUE(mentions(atlas->warnings[0], "'left' and 'right'")) << atlas->warnings[0];
  EXPECT_TRUE(read_atlas(write_atlas(*atlas), scene));  // each point has one triangle
  for (size_t i = 0; i < atlas->sites.size(); ++i)      // the first one: column 31 is all the left's
    if (atlas->sites.texel[i] % 64 == 31)
      for (uint32_t w = atlas->sites.first_word[i] + 2; w < atlas->sites.first_word[i + 1]; w += 4)
        EXPECT_EQ(atlas->sites.words[w + 2], 0u);
}

TEST(LayoutAtlas, ATexelOfTwoChartsGoesToTheOneWithMoreOfIt) {
  Scene scene = two_halves();
  for (Vec2& uv : scene.meshes[0].uv[1]) uv.x *= 20.3f / 24;  // left ends at 20.3, right begins at 20.4
  for (Vec2& uv : scene.meshes[1].uv[1]) uv.x = 1 - (1 - uv.x) * (27.6f / 24);
  const Atlas atlas = *build_atlas(scene, file_atlas(48));
  EXPECT_EQ(atlas.owner[48 * 20 + 19], 1u);
  EXPECT_EQ(atlas.owner[48 * 20 + 20], 2u);
}

}  // namespace
}  // namespace kiln
