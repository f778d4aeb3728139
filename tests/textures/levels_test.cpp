// Smaller levels are made inside of charts.
#include "coordinator/output/textures/levels.h"

#include <set>

#include "tests/textures/maps.h"

namespace kiln::test {
namespace {

// Every chart has a value of its own: any mix shows.
Baked numbered(uint32_t mips) {
  Baked b = baked_box(9, smooth_light(), mips);
  for (size_t t = 0; t < b.atlas.owner.size(); ++t)
    for (std::vector<float>& plane : b.map.planes.data) plane[t] = static_cast<float>(b.atlas.owner[t] * 8);
  return b;
}

TEST(MapLevels, NoTexelMixesCharts) {
  const Baked b = numbered(3);
  const std::vector<MapLevel> levels = map_levels(b.map, b.atlas, 3);
  ASSERT_EQ(levels.size(), 4u);
  std::set<float> charts;
  for (uint32_t o : b.atlas.owner) charts.insert(static_cast<float>(o * 8));
  for (const MapLevel& level : levels) {
    std::set<uint32_t> met;
    for (size_t t = 0; t < level.owner.size(); ++t) {
      if (!level.owner[t]) continue;
      const auto own =
          static_cast<float>(level.owner[t] * 8);  // weights of a mean add to 1 but for roundings
      ASSERT_NEAR(level.planes.plane("E.R")[t], own, 8 * 0x1p-24 * own);
      ASSERT_EQ(level.weight[t], 1.0f);
      met.insert(level.owner[t]);
    }
    EXPECT_EQ(met.size(), charts.size() - 1) << "a chart has been lost";
  }
  EXPECT_EQ(levels[3].planes.width, std::max(1u, b.atlas.width / 8));
}

TEST(MapLevels, AreMeansOfWhatIsCovered) {
  Baked b = baked_box(8, smooth_light());
  const MapLevel level = map_levels(b.map, b.atlas, 1)[1];
  const std::vector<float>& fine = b.map.planes.plane("L0.G");
  const std::vector<float>& coarse = level.planes.plane("L0.G");
  uint64_t whole = 0;
  for (uint32_t y = 0; y < level.page_height; ++y)
    for (uint32_t x = 0; x < level.planes.width; ++x) {
      const size_t t = size_t{y} * level.planes.width + x;
      double sum = 0;
      int count = 0;
      for (uint32_t k = 0; k < 4; ++k) {
        const size_t child = (2 * size_t{y} + k / 2) * b.atlas.width + 2 * x + k % 2;
        if (level.owner[t] == 0 || b.atlas.owner[child] != level.owner[t]) continue;
        sum += fine[child];
        ++count;
      }
      if (count == 0) continue;
      // Four floats added in float: three roundings of half an ulp each.
      EXPECT_NEAR(coarse[t], sum / count, 4 * 0x1p-24 * sum / count + 1e-9);
      whole += count == 4;
    }
  EXPECT_GT(whole, 100u);
}

TEST(MapLevels, EndAtOneTexelAndDropTheOddRow) {
  Baked b = baked_box(3, smooth_light());
  const std::vector<MapLevel> levels = map_levels(b.map, b.atlas, 30);
  EXPECT_EQ(levels.back().planes.width, 1u);
  EXPECT_EQ(levels.back().page_height, 1u);
  for (size_t k = 1; k < levels.size(); ++k) {
    EXPECT_EQ(levels[k].planes.width, std::max(1u, levels[k - 1].planes.width / 2));
    EXPECT_EQ(levels[k].planes.names, levels[0].planes.names);
  }
  for (const std::string& name : levels[0].planes.names) EXPECT_TRUE(name != "error" && name != "samples");
}

TEST(MapLevels, ARingAroundChartsHoldsTheirValuesForLookups) {
  const Baked b = numbered(1);
  const MapLevel level = map_levels(b.map, b.atlas, 1)[1];
  uint64_t ring = 0;
  for (size_t t = 0; t < level.owner.size(); ++t) {
    if (level.owner[t] || level.weight[t] != 1) continue;
    ++ring;
    EXPECT_GT(level.planes.plane("E.R")[t], 0);
  }
  EXPECT_GT(ring, 0u);
}

}  // namespace
}  // namespace kiln::test
