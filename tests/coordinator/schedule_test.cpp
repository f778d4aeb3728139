#include "coordinator/plan/schedule.h"

#include <set>

namespace kiln {
namespace {

TEST(Schedule, PassesDoubleFromMinToMax) {
  const auto passes = sample_passes(64, 1000);
  uint32_t next = 0;
  for (const SampleRange& p : passes) {
    EXPECT_EQ(p.first, next);
    next += p.count;
  }
  EXPECT_EQ(next, 1000u);
  EXPECT_EQ(passes[1].count, 64u);
  EXPECT_EQ(passes[2].count, 128u);
  EXPECT_EQ(sample_passes(100, 100).size(), 1u);
}

TEST(Schedule, RangesDependOnThePassAlone) {
  const auto ranges = ranges_of({4096, 4096});
  ASSERT_EQ(ranges.size(), 4u);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(ranges[i].first, 4096 + 1024 * i);
}

TEST(Schedule, EveryTexelAndSampleOnceWhateverTheTile) {
  std::vector<uint32_t> sites;
  for (uint32_t s = 3; s < 1000; s += 7) sites.push_back(s);
  for (uint32_t tile : {1u, 10u, 100000u}) {
    uint64_t id = 5;
    std::set<std::pair<uint32_t, uint32_t>> seen;
    std::set<uint64_t> ids;
    for (const WorkUnit& u : cut_pass(sites, {2048, 2500}, tile, id)) {
      EXPECT_TRUE(ids.insert(u.id).second);
      for (uint32_t s : u.sites) {
        EXPECT_TRUE(seen.insert({s, u.first_sample}).second);
        EXPECT_EQ((u.first_sample - 2048) % kRangeSamples, 0u);
      }
    }
    EXPECT_EQ(seen.size(), sites.size() * 3);
    EXPECT_EQ(id, 5 + ids.size());
  }
}

}  // namespace
}  // namespace kiln
