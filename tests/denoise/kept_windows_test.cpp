// Windows that are kept are those that were found.
#include "coordinator/bake/neighbours/kept_windows.h"

#include <gtest/gtest.h>

#include <array>

namespace kiln {
namespace {

std::vector<uint32_t> found(const KeptWindows& kept, uint32_t site) {
  std::array<uint32_t, 160> out;
  const size_t count = kept.find(site, out);
  return {out.begin(), out.begin() + static_cast<ptrdiff_t>(count)};
}

TEST(KeptWindows, AreThoseThatWereGiven) {
  KeptWindows kept(100'000);
  const std::vector<std::vector<uint32_t>> windows = {
      {5}, {1023, 1022, 0, 33'790}, {1024, 1023}, {99'999, 99'998, 67'231}, {40'000, 72'767, 7'232}};
  for (const std::vector<uint32_t>& window : windows) kept.keep(window);
  for (const std::vector<uint32_t>& window : windows) EXPECT_EQ(found(kept, window[0]), window);
  EXPECT_TRUE(found(kept, 6).empty());
}

TEST(KeptWindows, AreLeftOutWhereSitesAreFarApart) {
  KeptWindows kept(100'000);
  kept.keep(std::vector<uint32_t>{7, 8, 7 + 32'768});
  kept.keep(std::vector<uint32_t>{50'000, 49'999, 50'000 - 32'769});
  kept.keep(std::vector<uint32_t>{8, 7, 9});
  EXPECT_TRUE(found(kept, 7).empty());
  EXPECT_TRUE(found(kept, 50'000).empty());
  EXPECT_EQ(found(kept, 8), (std::vector<uint32_t>{8, 7, 9}));
}

TEST(KeptWindows, AreNotKeptOfHugeMaps) {
  KeptWindows kept(size_t{1} << 23);
  kept.keep(std::vector<uint32_t>{8, 7, 9});
  EXPECT_TRUE(found(kept, 8).empty());
}

}  // namespace
}  // namespace kiln
