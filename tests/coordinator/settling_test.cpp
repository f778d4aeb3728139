#include "coordinator/bake/sampling/settling.h"

#include <algorithm>

namespace kiln {
namespace {

constexpr double kError = 0.025, kSettled = kSettledPart * kError, kEnough = 1e9;
constexpr float kFew = 0.9f * kSettled * kSettled, kMuch = 4.0f * kSettled * kSettled;

std::vector<uint32_t> counts_of(const std::vector<SiteSamples>& work) {
  std::vector<uint32_t> counts;
  for (const SiteSamples& s : work) counts.push_back(s.range.count);
  return counts;
}

TEST(Settling, SitesWhoseErrorIsThatOfTheCachesBeginAgain) {
  const std::vector<float> shared = {kMuch, kFew, 0.0f, kMuch, kMuch};
  const std::vector<uint32_t> samples = {32, 32, 32, 0, 16};
  const auto work = Settling().next({shared, samples, 4096, kError, kEnough});
  ASSERT_EQ(work.size(), 2u) << "a site without samples, inside a wall, gets none";
  EXPECT_EQ(work[0].site, 0u);
  EXPECT_EQ(work[1].site, 4u);
  for (const SiteSamples& s : work) EXPECT_EQ(s.range.first, 0u);
  EXPECT_EQ(counts_of(work), (std::vector<uint32_t>{32, 16}));
}

TEST(Settling, SitesThatHardlyCountInTheNormAreLeft) {
  const std::vector<float> shared = {kMuch, kMuch, kMuch, kMuch}, mean = {1.0f, 0.1f, 0.06f, 0.04f};
  const std::vector<uint32_t> samples = {32, 32, 32, 32};
  SettlingState state{shared, samples, 4096, kError, kEnough, mean, 0.1};
  const auto work = Settling().next(state);  // kMuch is four times what is settled
  ASSERT_EQ(work.size(), 3u);
  EXPECT_EQ(work.back().site, 2u);
  EXPECT_DOUBLE_EQ(unsettled_share(state), 0.75);
  state.floor = 0;
  EXPECT_EQ(Settling().next(state).size(), 4u) << "the norm counts all";
}

TEST(Settling, TwiceAsManySamplesOnceABetterCacheIsNoHelp) {
  Settling settling;
  const std::vector<uint32_t> first = {32}, second = {64};
  std::vector<float> shared = {kMuch};
  EXPECT_EQ(counts_of(settling.next({shared, first, 100, kError, kEnough})), std::vector<uint32_t>{32});
  shared[0] = 0.8f * kMuch;
  EXPECT_EQ(counts_of(settling.next({shared, first, 100, kError, kEnough})), std::vector<uint32_t>{32});
  shared[0] = 0.8f * 0.9f * kMuch;
  EXPECT_EQ(counts_of(settling.next({shared, first, 100, kError, kEnough})), std::vector<uint32_t>{64});
  shared[0] = 0.8f * 0.9f * 0.9f * kMuch;
  EXPECT_EQ(counts_of(settling.next({shared, second, 100, kError, kEnough})), std::vector<uint32_t>{100})
      << "no site has more than it may have";
  shared[0] = kFew;
  EXPECT_TRUE(settling.next({shared, second, 100, kError, kEnough}).empty());
}

TEST(Settling, ShareOfSitesThatHaveNotSettled) {
  const std::vector<float> shared = {kMuch, kFew, 0.0f, kMuch, kMuch};
  const std::vector<uint32_t> samples = {32, 32, 32, 0, 16};
  EXPECT_DOUBLE_EQ(unsettled_share({shared, samples, 4096, kError, kEnough}), 0.5);
  EXPECT_EQ(unsettled_share({{}, samples, 4096, kError, kEnough}), 0.0);
}

TEST(Settling, RoundsTakeAShareOfTheSamplesToCome) {
  const std::vector<uint32_t> samples = {32};
  std::vector<float> shared = {kMuch};
  const double round = kReplicates * 32;
  EXPECT_TRUE(Settling().next({shared, samples, 4096, kError, 0.99 * round / kSettlingRound}).empty());
  const double to_come = 1.01 * round / kSettlingRound;
  Settling settling;
  double taken = 0;
  while (!settling.next({shared, samples, 4096, kError, to_come}).empty()) {
    taken += round;
    shared[0] *= 0.8f;
  }
  EXPECT_GT(shared[0], kSettled * kSettled) << "it did not end by itself";
  EXPECT_LE(taken, kSettlingShare * to_come);
  EXPECT_GT(taken + round, kSettlingShare * to_come);
}

// A round takes its time whatever the number of its sites.
TEST(Settling, FewSitesAloneDoNotBeginAgain) {
  std::vector<float> shared(100, 0.0f);
  const std::vector<uint32_t> samples(shared.size(), 32);
  std::fill_n(shared.begin(), 24, kMuch);
  EXPECT_TRUE(Settling().next({shared, samples, 4096, kError, kEnough}).empty());
  std::fill_n(shared.begin(), 26, kMuch);
  EXPECT_EQ(Settling().next({shared, samples, 4096, kError, kEnough}).size(), 26u);
  EXPECT_TRUE(Settling().next({shared, samples, 4096, 2.1 * kError, kEnough}).empty())
      << "what is little in the error of the whole bake";
}

// A nearly closed cavity keeps the error of its first cache, however many samples the next ones are made of.
TEST(Settling, FewSitesThatNoCacheHelpsAreLeftOutOfThem) {
  const std::vector<uint32_t> samples(100, 32);
  std::vector<float> shared(samples.size(), 0.0f);
  shared[7] = shared[50] = 1000 * kMuch;
  const SettlingState state{shared, samples, 4096, kError, kEnough};
  Settling settling;
  EXPECT_EQ(counts_of(settling.next(state)), (std::vector<uint32_t>{32, 32}));
  EXPECT_TRUE(settling.left_out().empty());
  EXPECT_EQ(counts_of(settling.next(state)), (std::vector<uint32_t>{32, 32}))
      << "by other paths, no more of them";
  EXPECT_EQ(settling.left_out(), (std::vector<uint32_t>{7, 50}));
  EXPECT_TRUE(settling.next(state).empty()) << "they do not come again";
  EXPECT_TRUE(settling.left_out().empty());

  shared[51] = 1000 * kMuch;
  Settling more;
  more.next(state);
  EXPECT_EQ(counts_of(more.next(state)), (std::vector<uint32_t>{64, 64, 64}))
      << "a room of sites is not left out";
  EXPECT_TRUE(more.left_out().empty());
}

TEST(Settling, NothingWithoutCaches) {
  const std::vector<uint32_t> samples = {32};
  EXPECT_TRUE(Settling().next({{}, samples, 4096, kError, kEnough}).empty());
}

}  // namespace
}  // namespace kiln
