// What layout pack promises of the atlas, checked texel by texel.
#include <atomic>
#include <set>

#include "common/atlas/atlas.h"
#include "common/raster/footprint.h"
#include "tests/atlas/shapes.h"

namespace kiln {
namespace {
using namespace test;

// Charts of many shapes and sizes.
Scene busy_scene() {
  Scene scene = scene_of({box({1, 2, 0.5f}, Uv::kUnit), sphere(16, 1), soup(60, 9), plane(3, 2, Uv::kUnit)});
  for (int i = 0; i < 12; ++i) {
    Mat4x3 to_world = at({0, 5.0f + 3.0f * i, 0});
    to_world[i % 3] *= 1.0f + 0.3f * i;
    scene.instances.push_back(instance(i % 4, "more " + std::to_string(i), to_world));
  }
  return scene;
}

Atlas packed(const Scene& scene, const AtlasSettings& settings) {
  Expected<Atlas> atlas = build_atlas(scene, settings);
  EXPECT_TRUE(atlas) << atlas.error().message;
  return atlas ? std::move(*atlas) : Atlas{};
}

uint32_t turned_count(const Atlas& atlas) {
  uint32_t n = 0;
  for (const ChartPlacement& place : atlas.placements) n += place.turned;
  return n;
}

// Charts whose bilinear footprint at mip `level` holds a texel of another chart. Mips are boxes of 2^level
// texels; a lookup anywhere on the chart touches the boxes whose centres lie within one box of it.
uint32_t mixed_at(const Atlas& atlas, uint32_t level) {
  const uint32_t cell = 1u << level, width = atlas.width / cell, height = atlas.height / cell;
  std::vector<std::set<uint32_t>> owners(size_t{width} * height * atlas.pages);
  for (size_t t = 0; t < atlas.owner.size(); ++t)
    if (atlas.owner[t]) {
      const size_t x = t % atlas.width / cell, y = t / atlas.width % atlas.height / cell;
      owners[(t / (size_t{atlas.width} * atlas.height) * height + y) * width + x].insert(atlas.owner[t]);
    }
  uint32_t mixed = 0;
  Random random(31);
  for (uint32_t i = 0; i < atlas.charts_of_instance.size(); ++i) {
    const MeshCharts& charts = atlas.of_instance(i);
    for (size_t f = 0; f < charts.face_count(); ++f) {
      const uint32_t p = atlas.instance_first_chart[i] + charts.chart_of_face[f];
      const Triangle2 t = texel_triangle(charts, atlas.placements[p], f);
      for (int k = 0; k < 30; ++k) {
        double b1 = random.next(), b2 = random.next();
        if (k < 3) b1 = k == 1, b2 = k == 2;
        if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
        const DVec2 q = (t.c[0] + b1 * (t.c[1] - t.c[0]) + b2 * (t.c[2] - t.c[0])) / double(cell) - 0.5;
        for (int tap = 0; tap < 4; ++tap) {
          const double fx = q.x - std::floor(q.x), fy = q.y - std::floor(q.y);
          if ((tap & 1 ? fx : 1 - fx) * (tap & 2 ? fy : 1 - fy) < 1.0 / 256)
            continue;  // as no texture unit tells
          const double x = std::floor(q.x) + (tap & 1), y = std::floor(q.y) + (tap >> 1);
          if (x < 0 || y < 0 || x >= width || y >= height) continue;  // the edge is repeated
          const auto& at =
              owners[(size_t{atlas.placements[p].page} * height + size_t(y)) * width + size_t(x)];
          mixed += at.size() > 1 || (at.size() == 1 && *at.begin() != p + 1);
        }
      }
    }
  }
  return mixed;
}

TEST(PackLayout, ChartsAreTurnedAndStillOwnWhatLookupsTouch) {
  const Atlas atlas = packed(busy_scene(), pack_at(6));
  EXPECT_GT(turned_count(atlas), 10u);
  EXPECT_LT(turned_count(atlas), atlas.placements.size() - 10);
  for (const ChartPlacement& place : atlas.placements) {
    EXPECT_EQ(place.scale.x < 0, place.turned == 1);  // a turn, not a mirror
    EXPECT_GT(place.scale.y, 0);
  }
  EXPECT_EQ(mixed_at(atlas, 0), 0u);
}

// The mask of the turned placement is the turned mask, but for lookups of weight 1/256 and less.
TEST(PackLayout, ATurnedChartHasTheTurnedFootprint) {
  const Scene scene = busy_scene();
  const Atlas atlas = packed(scene, pack_at(6));
  uint64_t texels = 0, other = 0;
  for (uint32_t i = 0; i < atlas.charts_of_instance.size(); ++i) {
    const MeshCharts& charts = atlas.of_instance(i);
    for (size_t f = 0; f < charts.face_count(); ++f) {
      const uint32_t p = atlas.instance_first_chart[i] + charts.chart_of_face[f];
      const ChartPlacement& place = atlas.placements[p];
      if (!place.turned) continue;
      for_each_footprint_span(
          texel_triangle(charts, place, f), atlas.width, atlas.height,
          [&](uint32_t y, uint32_t x0, uint32_t x1) {
            for (uint32_t x = x0; x <= x1; ++x, ++texels)
              other += atlas.owner[(size_t{place.page} * atlas.height + y) * atlas.width + x] != p + 1;
          });
    }
  }
  EXPECT_GT(texels, 1000u);
  EXPECT_LE(other, texels / 1000);
  uint64_t sites_of_turned = 0;
  for (size_t s = 0; s < atlas.sites.size(); ++s)
    sites_of_turned += atlas.placements[atlas.owner[atlas.sites.texel[s]] - 1].turned;
  EXPECT_GT(sites_of_turned, 500u);
}

TEST(PackLayout, NoBlockHasTwoCharts) {
  AtlasSettings settings = pack_at(6);
  const auto shared_blocks = [](const Atlas& atlas) {
    std::vector<uint32_t> owner(atlas.texel_count());
    uint32_t shared = 0;
    for (size_t t = 0; t < atlas.owner.size(); ++t) {
      if (!atlas.owner[t]) continue;
      uint32_t& block = owner[t / atlas.width / 4 * atlas.width + t % atlas.width / 4];
      shared += block && block != atlas.owner[t];
      block = atlas.owner[t];
    }
    return shared;
  };
  EXPECT_GT(shared_blocks(packed(busy_scene(), settings)), 100u);
  settings.block_align = true;
  const Atlas atlas = packed(busy_scene(), settings);
  EXPECT_EQ(shared_blocks(atlas), 0u);
  EXPECT_TRUE(atlas.width % 4 == 0 && atlas.height % 4 == 0);
  EXPECT_GT(turned_count(atlas), 10u);
  EXPECT_EQ(mixed_at(atlas, 0), 0u);
}

TEST(PackLayout, NoLookupMixesChartsUpToTheMipLevel) {
  const Scene scene = busy_scene();
  AtlasSettings settings = pack_at(6);
  EXPECT_GT(mixed_at(packed(scene, settings), 1), 0u);
  for (uint32_t levels : {1u, 2u, 3u})
    for (bool blocks : {false, true}) {
      settings.mip_levels = levels;
      settings.block_align = blocks;
      const Atlas atlas = packed(scene, settings);
      EXPECT_TRUE(atlas.width % (1 << levels) == 0 && atlas.height % (1 << levels) == 0);
      for (uint32_t level = 0; level <= levels; ++level)
        EXPECT_EQ(mixed_at(atlas, level), 0u) << level << " of " << levels;
    }
}

TEST(PackLayout, AChartOfAWholePageFitsWhateverTheCells) {
  const Scene scene = scene_of({plane(4, 1000, Uv::kUnit)});
  for (uint32_t levels : {0u, 1u, 2u, 5u})
    for (bool blocks : {false, true})
      for (uint32_t side : {256u, 255u, 130u}) {
        AtlasSettings settings = pack_at(4);
        settings.max_page_size = side;
        settings.mip_levels = levels;
        settings.block_align = blocks;
        const Atlas atlas = packed(scene, settings);
        EXPECT_LE(std::max(atlas.width, atlas.height), side);
        EXPECT_GE(std::max(atlas.width, atlas.height) + (2u << levels) + 4, side);
      }
}

TEST(PackLayout, PowersOfTwo) {
  AtlasSettings settings = pack_at(5);
  settings.power_of_two = true;
  for (uint32_t side : {8192u, 200u}) {
    settings.max_page_size = side;
    const Atlas atlas = packed(busy_scene(), settings);
    EXPECT_TRUE(std::has_single_bit(atlas.width) && std::has_single_bit(atlas.height));
    EXPECT_LE(std::max(atlas.width, atlas.height), side);
  }
}

TEST(PackLayout, TheBudgetLowersTheDensityAndIsUsed) {
  const Scene scene = busy_scene();
  const Atlas free = packed(scene, pack_at(10));
  EXPECT_EQ(free.statistics.texels_per_metre, 10);
  for (double part : {0.7, 0.3, 0.1}) {
    AtlasSettings settings = pack_at(10);
    settings.texel_budget = static_cast<uint64_t>(part * static_cast<double>(free.texel_count()));
    const Atlas atlas = packed(scene, settings);
    EXPECT_LE(atlas.texel_count(), settings.texel_budget);
    EXPECT_GE(static_cast<double>(atlas.texel_count()), 0.85 * static_cast<double>(settings.texel_budget));
    EXPECT_LT(atlas.statistics.texels_per_metre, 10);
    ASSERT_FALSE(atlas.notes.empty());
    EXPECT_NE(atlas.notes.back().find("--max-texels"), std::string::npos) << atlas.notes.back();
  }
  AtlasSettings settings = pack_at(10);
  settings.texel_budget = 50;
  const auto none = build_atlas(scene, settings);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("--max-texels"), std::string::npos);
}

// Where charts are cut depends on the size of a texel, so a lower density is cut anew.
TEST(PackLayout, TheBudgetHoldsWhereChartsAreCut) {
  Scene scene = scene_of({plane(4, 12, Uv::kUnit), box({0.1f, 2, 6}, Uv::kUnit)});
  scene.instances[1].to_world = at({6, 0, 3});  // a wall in the middle of the floor
  AtlasSettings settings = pack_at(10);
  settings.cut_contacts = true;
  const Atlas free = packed(scene, settings);
  settings.texel_budget = free.texel_count() / 3;
  const Atlas atlas = packed(scene, settings);
  EXPECT_LE(atlas.texel_count(), settings.texel_budget);
  EXPECT_GE(static_cast<double>(atlas.texel_count()), 0.75 * static_cast<double>(settings.texel_budget));
  AtlasSettings lower = settings;
  lower.texels_per_metre = atlas.statistics.texels_per_metre;
  lower.texel_budget = 0;
  EXPECT_EQ(packed(scene, lower).placements.size(), atlas.placements.size());
}

// Whatever density is wished for: the layout is that of the budget, and of the density that the report
// states.
TEST(PackLayout, TheBudgetDecidesAloneAboveIt) {
  Scene scene = scene_of({plane(4, 12, Uv::kUnit), box({0.1f, 2, 6}, Uv::kUnit), box({1, 1, 1}, Uv::kUnit)});
  scene.instances[1].to_world = at({6, 0, 3});
  scene.instances[2].to_world = at({2, -0.5f, 2});
  for (const uint64_t budget : {20000u, 3000u, 500u, 120u}) {
    std::vector<Atlas> atlases;
    for (const float wished : {30.0f, 47.0f, 300.0f, 4000.0f}) {
      AtlasSettings settings = pack_at(wished);
      settings.cut_contacts = true;
      settings.texel_budget = budget;
      atlases.push_back(packed(scene, settings));
      EXPECT_LE(atlases.back().texel_count(), budget);
    }
    AtlasSettings stated = pack_at(atlases[0].statistics.texels_per_metre);
    stated.cut_contacts = true;
    atlases.push_back(packed(scene, stated));
    for (const Atlas& atlas : atlases) {
      EXPECT_EQ(atlas.statistics.texels_per_metre, atlases[0].statistics.texels_per_metre) << budget;
      EXPECT_EQ(atlas.owner, atlases[0].owner) << budget;
      EXPECT_EQ(write_atlas(atlas), write_atlas(atlases[0])) << budget;
    }
  }
}

TEST(PackLayout, DensityByInstance) {
  const Scene scene = scene_of({plane(4, 8, Uv::kUnit), plane(4, 8, Uv::kUnit)});
  AtlasSettings settings = pack_at(4);
  settings.density = {1, 2.5f};
  const Atlas atlas = packed(scene, settings);
  EXPECT_NEAR(std::abs(atlas.placements[0].scale.x), 32, 1e-3);
  EXPECT_NEAR(std::abs(atlas.placements[1].scale.x), 80, 1e-3);
  settings.texel_budget = atlas.texel_count() / 2;
  const Atlas less = packed(scene, settings);
  const double ratio = std::abs(less.placements[1].scale.x / less.placements[0].scale.x);
  EXPECT_NEAR(ratio, 2.5, 2.5 / 20);  // whole steps of 20 texels and more
  settings.density = {1, NAN};
  const auto refused = build_atlas(scene, settings);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("'plane 1'"), std::string::npos) << refused.error().message;
}

TEST(PackLayout, EveryStepSaysHowLongItTook) {
  AtlasSettings settings = pack_at(6);
  settings.cut_contacts = true;
  const Atlas atlas = packed(busy_scene(), settings);
  std::string names;
  for (const StageTime& step : atlas.statistics.steps) names += step.name + " ";
  EXPECT_EQ(names, "charts contacts masks pack sites ");
}

TEST(PackLayout, SameBytesForAnyNumberOfThreads) {
  AtlasSettings settings = pack_at(6);
  settings.mip_levels = 1;
  settings.block_align = true;
  settings.max_page_size = 160;
  settings.threads = 1;
  const Scene scene = busy_scene();
  const Atlas one = packed(scene, settings);
  settings.threads = 3;
  const Atlas many = packed(scene, settings);
  EXPECT_GT(one.pages, 1u);
  EXPECT_EQ(write_atlas(one), write_atlas(many));
  EXPECT_EQ(one.owner, many.owner);
}

// Whenever it is told to stop, the layout ends with what it was told; told nothing, it is as without.
TEST(PackLayout, EndsWhenItIsToldTo) {
  const Scene scene = busy_scene();
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = 8;
  const Bytes whole = write_atlas(packed(scene, settings));
  uint32_t asked = 0;
  for (uint32_t last = 0;; ++last) {
    std::atomic<uint32_t> count = 0;
    settings.may_go_on = [&]() -> Status {
      return count++ < last ? Status{} : fail(ErrorKind::kTooShort, "enough");
    };
    const Expected<Atlas> atlas = build_atlas(scene, settings);
    asked = count;
    if (atlas) {
      EXPECT_EQ(write_atlas(*atlas), whole);
      break;
    }
    ASSERT_EQ(atlas.error().kind, ErrorKind::kTooShort) << last;
    ASSERT_EQ(atlas.error().message, "enough");
  }
  EXPECT_GT(asked, 20u);  // before each mesh, each run of triangles, each instance and each step
}

}  // namespace
}  // namespace kiln
