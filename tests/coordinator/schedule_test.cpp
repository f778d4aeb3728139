#include "coordinator/bake/sampling/schedule.h"

#include <cmath>
#include <map>
#include <set>
#include <tuple>

namespace kiln {
namespace {

TEST(Schedule, CountsAreFourToEachPowerOfTwo) {
  std::set<uint32_t> counts;
  for (uint32_t needed = 1; needed <= 4096; ++needed) {
    const uint32_t count = sample_count(needed);
    EXPECT_GE(count, needed);
    EXPECT_EQ(sample_count(count), count) << "a count is its own";
    if (needed > 4) EXPECT_LE(count, needed * 1.25 + 1);
    counts.insert(count);
  }
  for (uint32_t power = 16; power < 4096; power *= 2)
    EXPECT_EQ(std::distance(counts.lower_bound(power), counts.lower_bound(2 * power)), 4) << power;
  for (uint32_t count : {16u, 20u, 24u, 28u, 32u, 40u, 48u, 56u, 64u})
    EXPECT_TRUE(counts.count(count)) << count;
}

TEST(Schedule, CountsOfWhatIsNoCountOfSamples) {
  EXPECT_EQ(sample_count(0), 1u);
  EXPECT_EQ(sample_count(-5), 1u);
  EXPECT_EQ(sample_count(std::nan("")), 1u);
  EXPECT_EQ(sample_count(16.01), 20u);
  EXPECT_EQ(sample_count(INFINITY), 1u << 30);
  EXPECT_EQ(sample_count(1e300), 1u << 30);
}

TEST(Schedule, SamplesGrowTowardsWhatIsNeeded) {
  const std::vector<double> needed = {10, 40, 1000, 17, 1000, 64};
  const std::vector<uint32_t> have = {16, 16, 16, 16, 0, 64};
  const auto to = [&](uint32_t most, double least) {
    std::map<uint32_t, uint32_t> counts;
    for (const SiteSamples& s : work_towards(needed, have, most, least)) {
      EXPECT_EQ(s.range.first, have[s.site]);
      counts[s.site] = s.range.first + s.range.count;
    }
    return counts;
  };
  using Counts = std::map<uint32_t, uint32_t>;
  EXPECT_EQ(to(512, 1), (Counts{{1, 40}, {2, 64}, {3, 20}}));
  EXPECT_EQ(to(512, 2), (Counts{{1, 40}, {2, 64}, {3, 32}}));
  EXPECT_EQ(to(32, kGrowth), (Counts{{1, 32}, {2, 32}, {3, 32}}));
  EXPECT_EQ(to(16, 1), Counts());
}

TEST(Schedule, LargeMapsBeginWithFewerWholePaths) {
  const std::pair<size_t, uint32_t> expected[] = {{1, 16},      {65'535, 16}, {65'536, 8},
                                                  {131'071, 8}, {131'072, 4}, {size_t{1} << 40, 4}};
  for (const auto& [sites, samples] : expected) EXPECT_EQ(pilot_samples(sites), samples) << sites;
}

TEST(Schedule, MapsOfMillionsBeginWithOneTexelOfFour) {
  EXPECT_EQ(pilot_stride(639'098), 1u);
  EXPECT_EQ(pilot_stride((1u << 20) - 1), 1u);
  EXPECT_EQ(pilot_stride(1u << 20), 2u);
  EXPECT_EQ(pilot_stride(30'000'000), 2u);
}

TEST(Schedule, RangesDependOnThePassAlone) {
  const auto ranges = ranges_of({4096, 4096});
  ASSERT_EQ(ranges.size(), 4u);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(ranges[i].first, 4096 + 1024 * i);
}

TEST(Schedule, EveryTexelSampleAndReplicateOnceWhateverTheTile) {
  // Three kinds of texels: other samples so far, or another need.
  const SampleRange kinds[] = {{2048, 2500}, {2048, 16}, {64, 2500}};
  std::vector<SiteSamples> work;
  for (uint32_t s = 3; s < 1000; s += 7) work.push_back({s, kinds[s % 3]});
  work.push_back({1001, {64, 0}});  // needs nothing: no unit has it
  const Digest caches[] = {sha256(bytes_of("0")), sha256(bytes_of("1"))};
  for (uint32_t tile : {1u, 10u, 100000u}) {
    uint64_t id = 5;
    std::set<std::tuple<uint32_t, uint32_t, uint32_t>> seen;
    std::set<uint64_t> ids;
    for (const WorkUnit& u : cut_pass(work, tile, caches, id)) {
      EXPECT_TRUE(ids.insert(u.id).second);
      ASSERT_LT(u.replicate, kReplicates);
      EXPECT_EQ(u.cache, caches[u.replicate]);
      EXPECT_TRUE(std::is_sorted(u.sites.begin(), u.sites.end()));
      for (uint32_t s : u.sites) {
        const SampleRange& range = kinds[s % 3];
        ASSERT_EQ((u.first_sample - range.first) % kRangeSamples, 0u);
        EXPECT_EQ(u.sample_count, std::min(kRangeSamples, range.first + range.count - u.first_sample));
        for (uint32_t k = 0; k < u.sample_count; ++k)
          EXPECT_TRUE(seen.insert({s, u.replicate, u.first_sample + k}).second);
      }
    }
    size_t samples = 0;
    for (const SiteSamples& s : work) samples += kReplicates * s.range.count;
    EXPECT_EQ(seen.size(), samples);
    EXPECT_EQ(id, 5 + ids.size());
  }
}

TEST(Schedule, SamplesOfOneTakeShareUnits) {
  const std::vector<SiteSamples> work = {{0, {0, 16}}, {1, {0, 16}, 2}, {2, {0, 16}}, {3, {0, 16}, 2}};
  uint64_t id = 0;
  std::map<uint32_t, std::vector<uint32_t>> sites_of;  // by take
  for (const WorkUnit& u : cut_pass(work, 1000, {}, id))
    if (u.replicate == 0) sites_of[u.take] = u.sites;
  EXPECT_EQ(sites_of, (std::map<uint32_t, std::vector<uint32_t>>{{0, {0, 2}}, {2, {1, 3}}}));
  EXPECT_EQ(id, 2u * kReplicates);
}

TEST(Schedule, WithoutCachesUnitsNameNone) {
  uint64_t id = 0;
  for (const WorkUnit& u : cut_pass({{0, {0, 16}}}, 8, {}, id)) EXPECT_EQ(u.cache, Digest{});
  EXPECT_EQ(id, uint64_t{kReplicates});
}

}  // namespace
}  // namespace kiln
