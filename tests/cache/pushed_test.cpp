// A closed place stays dark where samples of its texels are moved out of geometry.
#include "common/responses/basis.h"
#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/bake/neighbours/half_hidden.h"
#include "tests/analytic/scene_maker.h"
#include "tests/cache/cached_bake.h"

namespace kiln {
namespace {

using test::CachedBake;
using test::SceneMaker;

// A plate hangs in a closed crate that stands on a floor under the sky, and faces down. Near the crate's
// walls the floor inside sees mostly back faces, so its samples are moved out, under the sky. The plate sees
// that floor.
Scene crate_with_plate() {
  SceneMaker m;
  const uint32_t white = m.lambert(Vec3(0.8f));
  m.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, white);
  m.box({0.5f, -0.1f, 0.5f}, {3.5f, 2, 3.5f}, false, white);
  m.quad({1.5f, 0.55f, 1.5f}, {1, 0, 0}, {0, 0, 1}, white);
  m.environment(Vec3(1.0f));
  return m.take();
}

TEST(PushedTexels, LightNothingInside) {
  constexpr uint32_t kSamples = 64, kPlate = 7;  // after the floor and six sides
  const TransportSettings settings;
  const CachedBake b(crate_with_plate(), 4, settings);
  Accumulator sums(static_cast<uint32_t>(b.sites()), MomentLayout(settings.basis));
  WorkUnit all{0, 0, kSamples, {}};
  for (uint32_t s = 0; s < b.sites(); ++s) all.sites.push_back(s);
  const auto whole = b.run(0, kSamples);
  ASSERT_TRUE(whole);
  ASSERT_TRUE(sums.add(all, *whole));
  IrradianceCache cache = sums.cache(0);
  // As in bakes: paths go on at texels that the crate stands across.
  const auto hidden = half_hidden_sites(b.scene(), b.atlas(), site_geometry(b.scene(), b.atlas(), 0), 2, 1e9);
  ASSERT_TRUE(hidden);
  for (uint32_t s = 0; s < b.sites(); ++s)
    if ((*hidden)[s]) cache.irradiance[s] = Vec3(-1.0f);
  const auto read = b.run(kSamples, kSamples, &cache);
  ASSERT_TRUE(read);
  size_t pushed = 0, plate = 0;
  for (uint32_t s = 0; s < b.sites(); ++s) {
    const size_t at = s * whole->plane_count;
    pushed += whole->moments[at + kMomentPushed] > 0 && whole->moments[at + kMomentLum] > 0;
    if (b.instance_of(s) != kPlate) continue;
    ++plate;
    EXPECT_EQ(whole->moments[at + kMomentLum], 0.0);
    EXPECT_EQ(read->moments[at + kMomentLum], 0.0);
  }
  EXPECT_GT(pushed, 8u);
  EXPECT_GT(plate, 16u);
}

}  // namespace
}  // namespace kiln
