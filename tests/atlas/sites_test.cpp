#include "common/atlas/sites.h"

#include <bit>
#include <map>

#include "common/raster/coverage.h"
#include "tests/atlas/shapes.h"

namespace kiln {
namespace {
using namespace test;

constexpr TexelRect kImage{0, 0, 64, 64};

TEST(Coverage, EachPointOfATessellatedSquareIsCoveredOnce) {
  // A fan around corners that lie exactly on site points, on texel borders and anywhere.
  Random random(11);
  for (int trial = 0; trial < 400; ++trial) {
    DVec2 middle(3 + 26 * random.next(), 3 + 26 * random.next());
    if (trial % 2) {
      const Vec2 site = site_point(random.below(64));
      middle = DVec2(1.0 + random.below(28) + site.x, 1.0 + random.below(28) + site.y);
    }
    std::vector<DVec2> ring;
    for (int k = 0; k < 32; ++k) ring.push_back({double(k), 0.0});
    for (int k = 0; k < 32; ++k) ring.push_back({32.0, double(k)});
    for (int k = 32; k > 0; --k) ring.push_back({double(k), 32.0});
    for (int k = 32; k > 0; --k) ring.push_back({0.0, double(k)});
    std::map<uint32_t, uint64_t> covered;
    for (size_t i = 0; i < ring.size(); ++i) {
      Triangle2 t{{middle, ring[i], ring[(i + 1) % ring.size()]}};
      if (trial % 3 == 0) std::swap(t.c[0], t.c[1]);
      for_each_cover(t, kImage, [&](uint32_t x, uint32_t y, uint64_t mask) {
        uint64_t& texel = covered[y * 64 + x];
        ASSERT_EQ(texel & mask, 0u) << "covered twice, trial " << trial;
        texel |= mask;
      });
    }
    ASSERT_EQ(covered.size(), 32u * 32u);
    for (const auto& [texel, mask] : covered)
      ASSERT_EQ(mask, ~uint64_t{0}) << "trial " << trial << " texel " << texel;
  }
}

TEST(Coverage, EqualsPointByPoint) {
  Random random(12);
  for (int trial = 0; trial < 600; ++trial) {
    Triangle2 t;
    const double size = trial % 2 ? 3 : 80;
    const DVec2 base(70 * random.next() - 3, 70 * random.next() - 3);
    for (DVec2& c : t.c) c = base + size * DVec2(random.next() - 0.5, random.next() - 0.5);
    std::map<uint32_t, uint64_t> found;
    for_each_cover(t, kImage, [&](uint32_t x, uint32_t y, uint64_t mask) { found[y * 64 + x] = mask; });
    for (uint32_t texel = 0; texel < 64 * 64; ++texel) {
      uint64_t expected = 0;
      const double sign = area2(t) < 0 ? -1 : 1;
      for (uint32_t j = 0; j < 64; ++j) {
        const DVec2 p = DVec2(texel % 64, texel / 64) + DVec2(site_point(j));
        bool inside = true;
        for (int k = 0; k < 3; ++k) inside &= sign * area2(t.c[k], t.c[(k + 1) % 3], p) > 0;
        expected |= uint64_t{inside} << j;
      }
      const auto it = found.find(texel);
      ASSERT_EQ(it == found.end() ? 0 : it->second, expected) << "trial " << trial;
    }
  }
}

TEST(SitePoints, AreHammersleyAndDistinct) {
  uint64_t columns = 0, rows = 0;
  for (uint32_t j = 0; j < 64; ++j) {
    columns |= uint64_t{1} << static_cast<int>(site_point(j).x * 64);
    rows |= uint64_t{1} << static_cast<int>(site_point(j).y * 64);
  }
  EXPECT_EQ(columns, ~uint64_t{0});
  EXPECT_EQ(rows, ~uint64_t{0});
  EXPECT_FLOAT_EQ(site_point(1).y, (32 + 0.5f) / 64);  // radical inverse of 000001
}

TEST(Sites, AFullSquareIsCoveredWhollyAndOnce) {
  const Scene scene = scene_of({unshared(plane(37, 5, Uv::kUnit))});
  const Atlas atlas = *build_atlas(scene, file_atlas(64));
  EXPECT_EQ(atlas.sites.size(), 64u * 64u);
  EXPECT_EQ(atlas.statistics.overlapped_points, 0u);
  for (size_t i = 0; i < atlas.sites.size(); ++i) {
    const uint32_t* record = &atlas.sites.words[atlas.sites.first_word[i]];
    EXPECT_EQ(record[0] & record[1], ~0u);
  }
}

TEST(Sites, PairsAreOrderedAndDisjoint) {
  const Scene scene = scene_of({sphere(40, 1), soup(200, 2), box(Vec3(1), Uv::kUnit)});
  const Atlas atlas = *build_atlas(scene, pack_at(9));
  const TexelSites& s = atlas.sites;
  ASSERT_EQ(s.first_word.size(), s.size() + 1);
  std::vector<bool> seen(atlas.texel_count());
  for (size_t i = 0; i < s.size(); ++i) {
    EXPECT_FALSE(seen[s.texel[i]]);
    seen[s.texel[i]] = true;
    const std::span<const uint32_t> record(&s.words[s.first_word[i]], s.first_word[i + 1] - s.first_word[i]);
    uint64_t valid = record[0] | uint64_t{record[1]} << 32;
    std::pair<uint32_t, uint32_t> previous{0, 0};
    for (size_t w = 2; w < record.size(); w += 4) {
      const uint64_t cover = record[w] | uint64_t{record[w + 1]} << 32;
      EXPECT_NE(cover, 0u);
      EXPECT_EQ(valid & cover, cover);
      valid &= ~cover;
      const std::pair<uint32_t, uint32_t> now{record[w + 2], record[w + 3]};
      if (w > 2) EXPECT_LT(previous, now);
      previous = now;
    }
    EXPECT_EQ(valid, 0u);
  }
}

// A mirrored TEXCOORD_1, a mirrored instance, slivers and a large page: what a pick says must be the point.
TEST(Sites, PicksReproduceTheirPoint) {
  Mesh mirrored = plane(7, 3, Uv::kUnit);
  for (Vec2& uv : mirrored.uv[1]) uv.x = 1 - uv.x;
  Scene scene = scene_of({mirrored, sphere(24, 2), soup(100, 3)});
  scene.instances[1].to_world[0] *= -1.0f;
  const Atlas atlas = *build_atlas(scene, pack_at(20));
  ASSERT_GT(atlas.sites.size(), 5000u);
  for (uint32_t i = 0; i < atlas.sites.size(); ++i) {
    const uint32_t* record = &atlas.sites.words[atlas.sites.first_word[i]];
    const uint64_t valid = record[0] | uint64_t{record[1]} << 32;
    const int n = std::popcount(valid);
    for (int k = 0; k < n; k += 5) {
      uint64_t rest = valid;
      for (int d = 0; d < k; ++d) rest &= rest - 1;
      const Vec2 point = site_point(static_cast<uint32_t>(std::countr_zero(rest)));
      const SitePick pick = pick_site(atlas, i, (static_cast<float>(k) + 0.5f) / static_cast<float>(n));
      ASSERT_GE(std::min(pick.b1, pick.b2), 0.0f);
      ASSERT_LE(pick.b1 + pick.b2, 1.0f + 1e-6f);
      const MeshCharts& charts = atlas.of_instance(pick.instance);
      const ChartPlacement& place =
          atlas.placements[atlas.instance_first_chart[pick.instance] + charts.chart_of_face[pick.triangle]];
      const Triangle2 t = texel_triangle(charts, place, pick.triangle);
      const DVec2 at = t.c[0] + double{pick.b1} * (t.c[1] - t.c[0]) + double{pick.b2} * (t.c[2] - t.c[0]);
      const uint32_t texel = atlas.sites.texel[i] % (atlas.width * atlas.height);
      ASSERT_NEAR(at.x, texel % atlas.width + double{point.x}, 1e-4);
      ASSERT_NEAR(at.y, texel / atlas.width + double{point.y}, 1e-4);
      ASSERT_EQ(place.page, atlas.sites.texel[i] / (atlas.width * atlas.height));
    }
  }
}

TEST(Sites, NeighboursInTheListAreNeighboursInTheWorld) {
  const Scene scene = scene_of({plane(32, 8, Uv::kUnit)});
  const Atlas atlas = *build_atlas(scene, file_atlas(128));
  const auto path = [&](const std::vector<uint32_t>& texels) {  // mean distance of successors, in texels
    double sum = 0;
    for (size_t i = 1; i < texels.size(); ++i) {
      const double dx = double(texels[i] % 128) - double(texels[i - 1] % 128);
      const double dy = double(texels[i] / 128) - double(texels[i - 1] / 128);
      sum += std::sqrt(dx * dx + dy * dy);
    }
    return sum / static_cast<double>(texels.size() - 1);
  };
  EXPECT_LT(path(atlas.sites.texel), 2.0);
  // A quarter of the list is a quarter of the plane, not 32 rows of it.
  uint32_t high = 0;
  for (size_t i = 0; i < 64 * 64; ++i)
    high = std::max({high, atlas.sites.texel[i] % 128, atlas.sites.texel[i] / 128});
  EXPECT_LT(high, 70u);
}

}  // namespace
}  // namespace kiln
