#include "coordinator/bake/sampling/settling.h"

namespace kiln {
namespace {

constexpr float kFew = 0.9f * kSettledError * kSettledError, kMuch = 0.01f * 0.01f;
constexpr double kEnough = 1e9;

std::vector<uint32_t> counts_of(const std::vector<SiteSamples>& work) {
  std::vector<uint32_t> counts;
  for (const SiteSamples& s : work) counts.push_back(s.range.count);
  return counts;
}

TEST(Settling, SitesWhoseErrorIsThatOfTheCachesBeginAgain) {
  const std::vector<float> shared = {kMuch, kFew, 0.0f, kMuch, kMuch};
  const std::vector<uint32_t> samples = {32, 32, 32, 0, 16};
  const auto work = Settling().next({shared, samples, 4096, kEnough});
  ASSERT_EQ(work.size(), 2u) << "a site without samples, inside a wall, gets none";
  EXPECT_EQ(work[0].site, 0u);
  EXPECT_EQ(work[1].site, 4u);
  for (const SiteSamples& s : work) EXPECT_EQ(s.range.first, 0u);
  EXPECT_EQ(counts_of(work), (std::vector<uint32_t>{32, 16}));
}

TEST(Settling, TwiceAsManySamplesOnceABetterCacheIsNoHelp) {
  Settling settling;
  const std::vector<uint32_t> first = {32}, second = {64};
  std::vector<float> shared = {kMuch};
  EXPECT_EQ(counts_of(settling.next({shared, first, 100, kEnough})), std::vector<uint32_t>{32});
  shared[0] = 0.8f * kMuch;
  EXPECT_EQ(counts_of(settling.next({shared, first, 100, kEnough})), std::vector<uint32_t>{32});
  shared[0] = 0.8f * 0.9f * kMuch;
  EXPECT_EQ(counts_of(settling.next({shared, first, 100, kEnough})), std::vector<uint32_t>{64});
  shared[0] = 0.8f * 0.9f * 0.9f * kMuch;
  EXPECT_EQ(counts_of(settling.next({shared, second, 100, kEnough})), std::vector<uint32_t>{100})
      << "no site has more than it may have";
  shared[0] = kFew;
  EXPECT_TRUE(settling.next({shared, second, 100, kEnough}).empty());
}

TEST(Settling, RoundsTakeAShareOfTheSamplesToCome) {
  const std::vector<uint32_t> samples = {32};
  std::vector<float> shared = {kMuch};
  const double round = kReplicates * 32;
  EXPECT_TRUE(Settling().next({shared, samples, 4096, 0.99 * round / kSettlingRound}).empty());
  const double to_come = 1.01 * round / kSettlingRound;
  Settling settling;
  double taken = 0;
  while (!settling.next({shared, samples, 4096, to_come}).empty()) {
    taken += round;
    shared[0] *= 0.8f;
  }
  EXPECT_GT(shared[0], kSettledError * kSettledError) << "it did not end by itself";
  EXPECT_LE(taken, kSettlingShare * to_come);
  EXPECT_GT(taken + round, kSettlingShare * to_come);
}

TEST(Settling, NothingWithoutCaches) {
  const std::vector<uint32_t> samples = {32};
  EXPECT_TRUE(Settling().next({{}, samples, 4096, kEnough}).empty());
}

}  // namespace
}  // namespace kiln
