// Windows that are found without a walk are those that walks find.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

#include "coordinator/bake/denoise/choice.h"
#include "tests/analytic/scene_maker.h"
#include "tests/denoise/fields.h"
#include "tests/denoise/replicates.h"
#include "tests/denoise/scenes.h"

namespace kiln {
namespace {

using namespace test;

MadeSurface plain_wall() {
  test::SceneMaker maker;
  maker.quad({0, 0, 0}, {0, 0, 4}, {6, 0, 0}, maker.lambert(Vec3(0.5f)));
  return MadeSurface(maker.take(), 8);
}

// Windows that are kept say what walks say.
TEST(Windows, KeptOnesChangeNothing) {
  const MadeSurface wall(test::wall_of_eight().scene, 8);
  const TexelStatistics s = noisy(
      wall.sites, [](const Vec3& p) { return 2 + std::sin(p.x); }, constant(0.3), 8);
  KeptWindows kept(s.sites);
  const Candidates walked = find_candidates(s, wall.sites, wall.links, 2),
                   first = find_candidates(s, wall.sites, wall.links, 2, {&kept}),
                   again = find_candidates(s, wall.sites, wall.links, 2, {&kept});
  for (uint32_t k = 0; k < kLevels; ++k) {
    EXPECT_EQ(first.variance[k], walked.variance[k]);
    EXPECT_EQ(again.variance[k], walked.variance[k]);
    for (uint32_t r = 0; r < kReplicates; ++r) {
      EXPECT_EQ(first.value[r][k], walked.value[r][k]);
      EXPECT_EQ(again.value[r][k], walked.value[r][k]);
    }
  }
  std::array<uint32_t, SurfaceWindow::kMax> window;
  EXPECT_GT(kept.find(0, window), 1u);
  const Choice chosen = choose(walked, wall.sites, wall.links, 2, {&kept}),
               of_walks = choose(walked, wall.sites, wall.links, 2);
  EXPECT_EQ(chosen.level, of_walks.level);
  EXPECT_EQ(chosen.bias, of_walks.bias);
}

// In the midst of a wall windows have one shape, with the weights that any window there has.
TEST(Windows, RegularOnesAreThoseThatWalksFind) {
  const MadeSurface wall = plain_wall();
  const TexelStatistics s = noisy(
      wall.sites, [](const Vec3& p) { return 2 + std::sin(p.x); }, constant(0.3), 8);
  const RegularWindows regular(wall.sites, wall.links, 2);
  const size_t whole = RegularWindows::shape().count;
  EXPECT_EQ(whole, 129u) << "places of a grid within 6.4";
  SurfaceWindow walked(wall.sites, wall.links);
  std::vector<uint8_t> known(wall.sites.size(), 1);
  size_t found = 0;
  for (uint32_t i = 0; i < wall.sites.size(); ++i)
    for (const float texels : {1.6f, 3.2f, 6.4f}) {
      std::array<uint32_t, SurfaceWindow::kMax> out;
      const size_t count = RegularWindows::shape().within(texels);
      if (!regular.find(i, known, count, out)) continue;
      const std::span<const uint32_t> window = walked.around(i, texels * wall.sites.texel_size[i]);
      EXPECT_EQ(std::set<uint32_t>(out.begin(), out.begin() + count),
                std::set<uint32_t>(window.begin(), window.end()));
      EXPECT_EQ(out[0], i);
      ++found;
    }
  EXPECT_GT(found, wall.sites.size()) << "a third of the sites, for three windows";

  const Candidates of_walks = find_candidates(s, wall.sites, wall.links, 2),
                   of_shape = find_candidates(s, wall.sites, wall.links, 2, {nullptr, &regular});
  const Choice choice = choose(of_walks, wall.sites, wall.links, 2),
               same = choose(of_walks, wall.sites, wall.links, 2, {nullptr, &regular});
  EXPECT_EQ(same.level, choice.level);
  for (size_t i = 0; i < s.sites; ++i)
    for (uint32_t k = 1; k < kLevels; ++k) {
      EXPECT_NEAR(of_shape.variance[k][i], of_walks.variance[k][i], 1e-5f * of_walks.variance[k][i]);
      for (uint32_t r = 0; r < kReplicates; ++r)
        EXPECT_NEAR(of_shape.value[r][k][i], of_walks.value[r][k][i], 1e-5f);
      EXPECT_NEAR(same.bias[i][k], choice.bias[i][k], 1e-5f);
    }
}

// The same wall as a checkerboard of two charts, which is no grid to regular windows and the same to others.
// Positions are rounded to 4e-6 of a texel, which moves weights by about 1e-5.
TEST(Windows, AWallIsFilteredAlikeWithRegularOnesAndOthers) {
  const MadeSurface wall = plain_wall();
  // Smooth light, and texels that are sharp by themselves.
  const Field field = [](const Vec3& p) {
    const bool is_sharp = static_cast<int>(8 * p.x) % 11 == 5 && static_cast<int>(8 * p.z) % 7 == 3;
    return (is_sharp ? 40 : 2) + std::sin(p.x);
  };
  const TexelStatistics s = noisy(wall.sites, field, constant(0.3), 8);
  const Denoised regular = denoise_luminance(s, wall.sites, wall.links, 2);
  SiteGeometry board = wall.sites;
  for (size_t i = 0; i < board.size(); ++i) board.placement[i] = (board.texel[i][0] + board.texel[i][1]) % 2;
  const Denoised other = denoise_luminance(s, board, wall.links, 2);
  size_t measured = 0;
  for (size_t i = 0; i < s.sites; ++i) {
    EXPECT_NEAR(regular.luminance[i], other.luminance[i], 1e-5f * 40) << i;
    EXPECT_NEAR(regular.standard_error[i], other.standard_error[i], 1e-3f * other.standard_error[i]) << i;
    measured += regular.strength[i] < 0.01f;
  }
  EXPECT_GT(measured, 10u);
}

// A grid that is bent, stretched, or of which a site is missing has windows of their own.
TEST(Windows, AreNotRegularWhereSitesAreNoGrid) {
  const MadeSurface wall = plain_wall();
  std::vector<uint8_t> known(wall.sites.size(), 1);
  std::array<uint32_t, SurfaceWindow::kMax> out;
  const size_t whole = RegularWindows::shape().count;
  uint32_t middle = 0;
  while (!RegularWindows(wall.sites, wall.links, 1).find(middle, known, whole, out)) ++middle;
  const uint32_t beside = out[whole - 1];
  known[beside] = 0;
  EXPECT_FALSE(RegularWindows(wall.sites, wall.links, 1).find(middle, known, whole, out));
  known[beside] = 1;
  const auto is_regular_with = [&](const auto& change) {
    SiteGeometry sites = wall.sites;
    change(sites);
    return RegularWindows(sites, wall.links, 1).find(middle, known, whole, out);
  };
  EXPECT_TRUE(is_regular_with([](SiteGeometry&) {}));
  EXPECT_FALSE(is_regular_with([&](SiteGeometry& s) { s.texel_size[beside] *= 2; }));
  EXPECT_FALSE(
      is_regular_with([&](SiteGeometry& s) { s.normal[beside] = normalize(s.normal[beside] + Vec3(0.1f)); }));
  EXPECT_FALSE(is_regular_with([&](SiteGeometry& s) { s.position[beside] += 0.1f * s.texel_size[beside]; }));
  EXPECT_FALSE(is_regular_with([&](SiteGeometry& s) { s.placement[beside] += 1; }));
  EXPECT_FALSE(is_regular_with([&](SiteGeometry& s) {
    for (Vec3& p : s.position) p *= Vec3(1, 1, 1.01f);
  }));
}

}  // namespace
}  // namespace kiln
