// Texels whose sites lie inside other geometry. The sky is 1 and nothing reflects, so that E is pi times the
// visible share: at least pi/2 beside a wall of any height, and what back faces darken lies below.
#include "common/responses/basis.h"
#include "tests/analytic/in_process.h"
#include "tests/analytic/scene_maker.h"

namespace kiln {
namespace {

using test::BakedTexel;

constexpr float kTexels = 4;  // per metre

struct Extent {
  Vec3 low{1e9f}, high{-1e9f};
};
Extent extent(const test::Bake& b, uint32_t site) {
  Extent e;
  test::texel_average(b, site, [&](const Vec3& p, const Vec3&) {
    e.low = glm::min(e.low, p);
    e.high = glm::max(e.high, p);
    return 0.0;
  });
  return e;
}

test::SceneMaker floor_under_sky() {
  test::SceneMaker m;
  const uint32_t black = m.lambert(Vec3(0.0f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, black);
  m.environment(Vec3(1.0f));
  return m;
}

// How far a texel's sites lie below a box that stands on the floor: 0 if one is outside.
float depth(const Extent& e, const Vec3& low, const Vec3& high) {
  return std::max(0.0f, std::min({e.low.x - low.x, high.x - e.high.x, e.low.z - low.z, high.z - e.high.z}));
}

void expect_clean_floor(const test::Bake& b, const Vec3& low, const Vec3& high) {
  size_t pushed = 0, buried = 0;
  for (const BakedTexel& t : b.texels) {
    const Extent e = extent(b, t.site);
    const bool all_outside = e.high.x < low.x || e.low.x > high.x || e.high.z < low.z || e.low.z > high.z;
    pushed += t.pushed;
    buried += t.inside;
    if (all_outside) EXPECT_FALSE(t.pushed || t.inside) << t.position.x << " " << t.position.z;
    // A bilinear lookup at the box's foot reads texels up to one below it.
    if (depth(e, low, high) < 1 / kTexels) EXPECT_FALSE(t.inside) << t.position.x << " " << t.position.z;
    if (!t.inside)
      EXPECT_GT(t.luminance, M_PI / 2 - 4 * t.standard_error) << t.position.x << " " << t.position.z;
    if (t.inside) EXPECT_EQ(t.luminance, 0.0);
  }
  EXPECT_GT(pushed, 8u);
  EXPECT_GT(buried, 0u);
}

TEST(Pushed, CrateOnAFloor) {
  test::SceneMaker m = floor_under_sky();
  const Vec3 low(0.87f, 0, 1.11f), high(3.17f, 1, 3.39f);  // its bottom lies in the floor's plane
  m.box(low, high, false);
  expect_clean_floor(test::bake(m.take(), kTexels, 256, {}, 0), low, high);
}

TEST(Pushed, WallThroughAFloor) {
  test::SceneMaker m = floor_under_sky();
  const Vec3 low(-1, -0.5f, 1.57f), high(5, 2, 3.23f);
  m.box(low, high, false);
  expect_clean_floor(test::bake(m.take(), kTexels, 256, {}, 0), low, high);
}

// A closed room, a wall across it from floor to ceiling, a lamp on one side: what is pushed goes to the
// nearer side, and nothing on the dark one or nearer to it is lit.
TEST(Pushed, NoLightThroughAWall) {
  for (const float thickness : {0.06f, 0.5f, 0.9f}) {
    test::SceneMaker m;
    const uint32_t black = m.lambert(Vec3(0.0f));
    m.quad({0, 0, 0}, {0, 0, 2}, {4, 0, 0}, black);
    const float left = 2.03f, right = left + thickness;
    m.box({0, -0.1f, 0}, {4, 2, 2}, true, black);
    m.box({left, -0.2f, -0.1f}, {right, 2.1f, 2.1f}, false, black);
    m.point({1, 1.5f, 1}, Vec3(10.0f));
    const test::Bake b = test::bake(m.take(), kTexels, 128, {}, 0);
    size_t dark = 0, lit = 0;
    for (const BakedTexel& t : b.texels) {
      const Extent e = extent(b, t.site);
      if (e.low.x > left + 0.5f * thickness + 0.01f) {
        EXPECT_EQ(t.luminance, 0.0) << t.position.x;
        dark += !t.inside;
      } else if (e.high.x < left + 0.5f * thickness - 0.01f && e.low.z > 0.01f && e.high.z < 1.99f) {
        EXPECT_GT(t.luminance, 0.0) << t.position.x;
        lit += t.pushed;
      }
    }
    EXPECT_GT(dark, 0u);
    if (thickness > 0.6f) EXPECT_GT(lit, 0u) << thickness;
  }
}

// A site is moved or not whatever the range of samples that asks, and a range's sums are those of its
// samples.
TEST(Pushed, DoesNotDependOnTheCutIntoRanges) {
  test::SceneMaker m = floor_under_sky();
  m.box({0.87f, 0, 1.11f}, {3.17f, 1, 3.39f}, false);
  Scene scene = m.take();
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = kTexels;
  a.cut_contacts = false;  // else nothing of the floor lies under the box
  const Atlas atlas = *build_atlas(scene, a);
  const auto sites = static_cast<uint32_t>(atlas.sites.size());
  const auto baker = *Baker::create(std::move(scene), atlas, {}, 1);
  double pushed = 0;
  for (uint32_t site = 0; site < sites; site += 3) {
    const UnitResult whole = *baker->bake({0, 0, 96, {site}});
    std::vector<double> parts(whole.plane_count, 0.0);
    for (const auto& [first, count] :
         std::vector<std::pair<uint32_t, uint32_t>>{{64, 32}, {0, 21}, {21, 43}}) {
      const UnitResult part = *baker->bake({0, first, count, {site}});
      for (uint32_t p = 0; p < part.plane_count; ++p) parts[p] += part.moments[p];
    }
    EXPECT_EQ(parts[kMomentPushed], whole.moments[kMomentPushed]);
    EXPECT_EQ(parts[kMomentInside], whole.moments[kMomentInside]);
    EXPECT_NEAR(parts[kMomentLum], whole.moments[kMomentLum], 1e-12 * whole.moments[kMomentLum]);
    pushed += whole.moments[kMomentPushed];
  }
  EXPECT_GT(pushed, 0);
}

}  // namespace
}  // namespace kiln
