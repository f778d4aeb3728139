// Texels under the edge of something are found, and no others.
#include "coordinator/bake/neighbours/half_hidden.h"

#include "tests/analytic/scene_maker.h"
#include "tests/denoise/fields.h"

namespace kiln {
namespace {

using test::MadeSurface;
using test::SceneMaker;

constexpr float kTexel = 0.125f, kLow = 1.13f, kHigh = 2.87f;

// A crate that hovers four centimetres above a floor of 4 x 4 m with eight texels a metre.
MadeSurface floor_under_crate() {
  SceneMaker maker;
  const uint32_t grey = maker.lambert(Vec3(0.5f));
  maker.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, grey);
  maker.box({kLow, 0.04f, kLow}, {kHigh, 1, kHigh}, false, grey);
  return MadeSurface(maker.take(), 1 / kTexel);
}

TEST(HalfHidden, AreTexelsUnderTheEdgeAndNotThoseBesideOrBelow) {
  const MadeSurface floor = floor_under_crate();
  const auto hidden = half_hidden_sites(floor.scene, floor.atlas, floor.sites, 2, 1e9);
  ASSERT_TRUE(hidden);
  ASSERT_EQ(hidden->size(), floor.sites.size());
  size_t edge = 0, found = 0, beside = 0, below = 0;
  for (size_t i = 0; i < floor.sites.size(); ++i) {
    const Vec3& p = floor.sites.position[i];
    if (p.y > 0.01f) continue;
    const float within = std::min({p.x - kLow, kHigh - p.x, p.z - kLow, kHigh - p.z});
    if (std::abs(within) < 0.25f * kTexel) {
      ++edge;
      found += (*hidden)[i];
    } else if (within < -kTexel) {
      ++beside;
      EXPECT_FALSE((*hidden)[i]) << p.x << " " << p.z;
    } else if (within > 3 * kTexel) {
      ++below;
      EXPECT_FALSE((*hidden)[i]) << p.x << " " << p.z;
    }
  }
  EXPECT_GT(edge, 20u);
  EXPECT_GE(found, edge - 4);  // of a texel under a corner three quarters may be open
  EXPECT_GT(beside, 400u);
  EXPECT_GT(below, 40u);
}

// A wall a centimetre thick, so near the floor that no line of contact is needed for light not to pass: the
// texels that it stands on are as open on one side of it as on the other.
TEST(HalfHidden, AreTexelsWithAWallAcrossThem) {
  SceneMaker maker;
  const uint32_t grey = maker.lambert(Vec3(0.5f));
  maker.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, grey);
  constexpr float kWall = 2.005f;  // a texel's middle, as kLow is
  maker.box({kWall - 0.005f, 0.01f, 0}, {kWall + 0.005f, 1, 4}, false, grey);
  const MadeSurface floor(maker.take(), 1 / kTexel);
  const auto hidden = half_hidden_sites(floor.scene, floor.atlas, floor.sites, 2, 1e9);
  ASSERT_TRUE(hidden);
  size_t across = 0, found = 0, beside = 0;
  for (size_t i = 0; i < floor.sites.size(); ++i) {
    const Vec3& p = floor.sites.position[i];
    if (p.y > 0.005f) continue;
    if (std::abs(p.x - kWall) < 0.25f * kTexel) {
      ++across;
      found += (*hidden)[i];
    } else if (std::abs(p.x - kWall) > kTexel) {
      ++beside;
      EXPECT_FALSE((*hidden)[i]) << p.x << " " << p.z;
    }
  }
  EXPECT_GT(across, 20u);
  EXPECT_EQ(found, across);
  EXPECT_GT(beside, 400u);
}

// A wall across the grid of texels cuts off an eighth of each that it meets: one corner, where few points
// are.
TEST(HalfHidden, AreTexelsOfWhichAWallCutsOffACorner) {
  SceneMaker maker;
  const uint32_t grey = maker.lambert(Vec3(0.5f));
  maker.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, grey);
  maker.quad({kTexel / 2, 0.01f, 0}, {4, 0, 4}, {0, 1, 0}, grey);
  const MadeSurface floor(maker.take(), 1 / kTexel);
  const auto hidden = half_hidden_sites(floor.scene, floor.atlas, floor.sites, 2, 1e9);
  ASSERT_TRUE(hidden);
  size_t cut = 0, beside = 0;
  for (size_t i = 0; i < floor.sites.size(); ++i) {
    const Vec3& p = floor.sites.position[i];
    if (p.y > 0.005f || std::min(p.x, p.z) < kTexel || std::max(p.x, p.z) > 4 - kTexel) continue;
    const float off = std::abs(p.x - p.z - kTexel / 2) / kTexel;
    if (off < 0.6f) {
      ++cut;
      EXPECT_TRUE((*hidden)[i]) << p.x << " " << p.z;
    } else if (off > 2.6f) {
      ++beside;
      EXPECT_FALSE((*hidden)[i]) << p.x << " " << p.z;
    }
  }
  EXPECT_GT(cut, 50u);
  EXPECT_GT(beside, 600u);
}

// Slats an eighth of a texel wide and a fiftieth above the floor cover some of its points. Seen from a tenth
// of a texel above it they are part of the floor.
TEST(HalfHidden, AreTexelsOfWhichAPartIsCovered) {
  SceneMaker maker;
  const uint32_t grey = maker.lambert(Vec3(0.5f));
  maker.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, grey);
  std::vector<float> slats;
  for (int k = 0; k < 8; ++k) {
    slats.push_back(0.5f + 3.6f * kTexel * static_cast<float>(k));
    maker.box({slats.back(), 0.02f * kTexel, 0.5f}, {slats.back() + kTexel / 8, 0.04f * kTexel, 3.5f}, false,
              grey);
  }
  const MadeSurface floor(maker.take(), 1 / kTexel);
  const auto hidden = half_hidden_sites(floor.scene, floor.atlas, floor.sites, 2, 1e9);
  ASSERT_TRUE(hidden);
  size_t partly = 0, beside = 0;
  for (size_t i = 0; i < floor.sites.size(); ++i) {
    const Vec3& p = floor.sites.position[i];
    if (p.y > 1e-6f || p.z < 0.5f + kTexel || p.z > 3.5f - kTexel) continue;
    float off = 1e9f;  // of the slat's middle from the texel's, in texels
    for (const float x : slats) off = std::min(off, std::abs(x + kTexel / 16 - p.x) / kTexel);
    if (off < 0.43f) {
      ++partly;
      EXPECT_TRUE((*hidden)[i]) << p.x << " " << p.z;
    } else if (off > 0.6f) {
      ++beside;
      EXPECT_FALSE((*hidden)[i]) << p.x << " " << p.z;
    }
  }
  EXPECT_GT(partly, 100u);
  EXPECT_GT(beside, 300u);
}

TEST(HalfHidden, AreTheSameForAnyNumberOfThreadsAndNoneOutOfTime) {
  const MadeSurface floor = floor_under_crate();
  EXPECT_EQ(half_hidden_sites(floor.scene, floor.atlas, floor.sites, 1, 1e9),
            half_hidden_sites(floor.scene, floor.atlas, floor.sites, 3, 1e9));
  EXPECT_FALSE(half_hidden_sites(floor.scene, floor.atlas, floor.sites, 1, 0));
}

}  // namespace
}  // namespace kiln
