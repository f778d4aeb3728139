#include "coordinator/merge/accumulator.h"

#include <algorithm>
#include <random>

#include "common/basis/basis.h"
#include "coordinator/plan/schedule.h"

namespace kiln {
namespace {

constexpr uint32_t kBasis = 1;

// A unit's sums as if every sample of every site were random but fixed.
UnitResult answer(const WorkUnit& unit) {
  UnitResult r;
  r.unit = unit.id;
  r.site_count = static_cast<uint32_t>(unit.sites.size());
  r.plane_count = static_cast<uint32_t>(moment_plane_names(kBasis).size());
  for (uint32_t site : unit.sites) {
    std::mt19937 random(site * 7919 + unit.first_sample);
    for (uint32_t p = 0; p < r.plane_count; ++p) r.moments.push_back(random() * 1e-7 * (p % 3 ? 1.0 : 1e-9));
  }
  return r;
}

std::vector<double> merged(std::vector<WorkUnit> units, size_t sites, unsigned shuffle) {
  std::shuffle(units.begin(), units.end(), std::mt19937(shuffle));
  Accumulator sums(sites, kBasis);
  for (const WorkUnit& u : units) EXPECT_TRUE(sums.add(u, answer(u)));
  std::vector<double> out;
  for (uint32_t s = 0; s < sites; ++s) {
    const auto e = sums.estimate(s);
    out.push_back(e.mean);
    out.push_back(e.standard_error);
    EXPECT_EQ(sums.samples(s), 5000u);
  }
  return out;
}

TEST(Accumulator, OrderOfArrivalAndCutChangeNoBit) {
  const size_t sites = 60;
  std::vector<uint32_t> all(sites);
  for (uint32_t s = 0; s < sites; ++s) all[s] = s;
  std::vector<double> first;
  for (uint32_t tile : {1u, 20u, 1000u})
    for (unsigned shuffle : {0u, 1u, 2u}) {
      uint64_t id = 0;
      auto units = cut_pass(all, {0, 5000}, tile, id);
      const auto result = merged(units, sites, shuffle);
      if (first.empty()) first = result;
      EXPECT_EQ(result, first) << tile << " " << shuffle;
    }
}

UnitResult of_samples(const WorkUnit& unit, const std::vector<double>& values, double inside = 0) {
  UnitResult r;
  r.unit = unit.id;
  r.site_count = 1;
  r.plane_count = static_cast<uint32_t>(moment_plane_names(0).size());
  r.moments.assign(r.plane_count, 0.0);
  r.moments[kMomentInside] = inside;
  for (double v : values) {
    r.moments[kMomentLum] += v;
    r.moments[kMomentLum2] += v * v;
  }
  return r;
}

TEST(Accumulator, StandardErrorOfKnownSamples) {
  Accumulator sums(1, 0);
  const WorkUnit unit{0, 0, 4, {0}};
  ASSERT_TRUE(sums.add(unit, of_samples(unit, {1, 2, 3, 6})));
  const auto e = sums.estimate(0);
  EXPECT_DOUBLE_EQ(e.mean, 3);
  EXPECT_NEAR(e.standard_error, std::sqrt((4 + 1 + 0 + 9) / 3.0 / 4), 1e-5);
  EXPECT_FALSE(sums.converged(0, 0.5, 1.96));
  EXPECT_TRUE(sums.converged(0, 1.0, 1.96));
}

TEST(Accumulator, InsideGeometryMeansMoreThanHalfOfTheRays) {
  for (double hits : {2.0, 3.0}) {
    Accumulator sums(1, 0);
    const WorkUnit unit{0, 0, 4, {0}};
    ASSERT_TRUE(sums.add(unit, of_samples(unit, {1, 2, 3, 6}, hits)));
    EXPECT_EQ(sums.estimate(0).inside, hits > 2);
    EXPECT_EQ(sums.converged(0, 0.001, 1.96), hits > 2);
  }
}

TEST(Accumulator, PushedMeansMoreThanHalfOfTheSamples) {
  Atlas atlas;
  atlas.width = atlas.height = 1;
  atlas.sites.texel = {0};
  for (double pushed : {2.0, 3.0}) {
    Accumulator sums(1, 0);
    const WorkUnit unit{0, 0, 4, {0}};
    UnitResult result = of_samples(unit, {1, 2, 3, 6});
    result.moments[kMomentPushed] = pushed;
    ASSERT_TRUE(sums.add(unit, result));
    EXPECT_EQ(sums.resolve(atlas).validity[0], pushed > 2 ? Validity::kPushed : Validity::kMeasured);
    result.moments[kMomentInside] = 3;  // pushed, and still inside
    Accumulator inside(1, 0);
    ASSERT_TRUE(inside.add(unit, result));
    EXPECT_EQ(inside.resolve(atlas).validity[0], Validity::kInside);
  }
}

TEST(Accumulator, WrongShapeIsRefused) {
  Accumulator sums(2, 0);
  const WorkUnit unit{0, 0, 4, {0, 1}};
  EXPECT_FALSE(sums.add(unit, of_samples(unit, {1})));
}

TEST(Accumulator, BlackTexelIsDone) {
  Accumulator sums(1, 0);
  const WorkUnit unit{0, 0, 4, {0}};
  ASSERT_TRUE(sums.add(unit, of_samples(unit, {0, 0, 0, 0})));
  EXPECT_TRUE(sums.converged(0, 0.05, 1.96));
}

}  // namespace
}  // namespace kiln
