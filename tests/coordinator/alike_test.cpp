// Sites that are visited as runs are those that would be visited one by one.
#include "coordinator/bake/sampling/alike.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

namespace kiln {
namespace {

constexpr size_t kSites = 1000;  // the last run is not whole

struct Map {
  TexelStatistics statistics;
  std::vector<uint32_t> chart;
};

// Charts that begin within runs, shadows with sharp edges, and some sites that are not known.
Map made_map() {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform;
  Map map;
  TexelStatistics& s = map.statistics;
  s.sites = kSites;
  s.known.assign(kSites, 1);
  for (size_t i = 0; i < kSites; ++i) {
    const float light = (i / 90 % 3 == 1 ? 0.1f : 1.0f) * (1 + 0.2f * uniform(random));
    for (auto& luminance : s.luminance) luminance.push_back(light);
    s.variance.push_back(i % 7 == 0 ? 4.0f : 0.01f);
    s.samples.push_back(4);
    map.chart.push_back(static_cast<uint32_t>(i / 250));
    if (i % 131 == 3) s.known[i] = 0;
  }
  return map;
}

std::vector<uint32_t> one_by_one(const Map& map, size_t i) {
  const TexelStatistics& s = map.statistics;
  std::vector<uint32_t> out;
  const auto square_of_error = [&](size_t j) { return s.variance[j] / (2.0 * s.samples[j]); };
  for (size_t j = i > kAlikeReach ? i - kAlikeReach : 0; s.known[i] && j <= i + kAlikeReach && j < kSites;
       ++j) {
    const double a = s.luminance[0][i], b = s.luminance[0][j];
    if (s.known[j] && map.chart[j] == map.chart[i] &&
        is_as_bright(a, b, std::max(square_of_error(i), square_of_error(j))))
      out.push_back(static_cast<uint32_t>(j));
  }
  return out;
}

TEST(Alike, RunsAreOfSitesThatAre) {
  const Map map = made_map();
  const AlikeRuns runs(map.statistics, map.chart);
  size_t in_runs = 0, alone = 0;
  for (size_t i = 0; i < kSites; ++i) {
    std::vector<uint32_t> visited;
    for_each_alike(
        map.statistics, map.chart, runs, i,
        [&](size_t j) {
          visited.push_back(static_cast<uint32_t>(j));
          ++alone;
        },
        [&](size_t r) {
          const size_t begin = visited.size();
          visited.resize(begin + kAlikeRun);
          std::iota(visited.begin() + static_cast<ptrdiff_t>(begin), visited.end(),
                    static_cast<uint32_t>(r * kAlikeRun));
          in_runs += kAlikeRun;
        });
    ASSERT_EQ(visited, one_by_one(map, i)) << i;
  }
  EXPECT_GT(in_runs, alone / 2);
  EXPECT_GT(alone, in_runs / 4);
}

}  // namespace
}  // namespace kiln
