// Charts of one layout in another: by their numbers, and by their places where another density cuts them
// elsewhere.
#include "coordinator/bake/collapse/same_charts.h"

#include "tests/unseen/world.h"

namespace kiln {
namespace {
using test::World;

Atlas layout(const World& world, float density) {
  AtlasSettings settings = test::pack_at(density);
  settings.cut_contacts = true;
  settings.unwrap.cache.clear();
  return *build_atlas(world.scene, settings);
}

// A floor with a wall across it, and a low step that is a contact only for small texels.
World floor_with_walls() {
  World world;
  world.add(test::plane(1, 8, test::Uv::kNone), "floor", Vec3(0.0f));
  world.solid({Vec3(3, 0, -1), Vec3(3.2f, 2, 9)}, "wall");
  world.solid({Vec3(-1, 0, 5), Vec3(9, 0.02f, 5.2f)}, "step");
  return world;
}

TEST(SameCharts, OfOneDensityAreTheirNumbers) {
  const World world = floor_with_walls();
  const Atlas a = layout(world, 4), b = layout(world, 4);
  const std::vector<uint32_t> same = same_charts(a, b);
  ASSERT_EQ(same.size(), a.placements.size());
  for (uint32_t p = 0; p < same.size(); ++p) EXPECT_EQ(same[p], p);
}

TEST(SameCharts, AreFoundByPlaceWhereAnotherDensityCutsElsewhere) {
  const World world = floor_with_walls();
  const Atlas coarse = layout(world, 1), fine = layout(world, 16);
  const uint32_t before = coarse.of_instance(0).chart_count, after = fine.of_instance(0).chart_count;
  ASSERT_GE(before, 2u);
  ASSERT_GT(after, before) << "the scene does not test anything";
  const std::vector<uint32_t> same = same_charts(coarse, fine), back = same_charts(fine, coarse);
  std::set<uint32_t> found;
  uint32_t lost = 0;
  for (uint32_t c = 0; c < after; ++c) {
    if (same[c] == kNoChart) {
      ++lost;
      continue;
    }
    EXPECT_LT(same[c], before);
    found.insert(same[c]);
  }
  EXPECT_LE(lost, 1u) << "where step and wall cross there were no texels";
  EXPECT_EQ(found.size(), before) << "each half of the floor has its parts";
  for (uint32_t c = 0; c < before; ++c)
    EXPECT_EQ(back[c], kNoChart) << "what lies on several charts is none of them";
}

TEST(ChartLists, ReadBackWhatTheyName) {
  const std::vector<uint8_t> charts = {2, 0, 3, 3, 3, 0, 2, 2, 1, 3};
  std::vector<uint8_t> back(charts.size(), 0);
  for (const CollapseReason why : {kUnseen, kUnlit, kEvenlyLit})
    EXPECT_TRUE(read_charts(list_charts(charts, why), why, back));
  EXPECT_EQ(back, charts);
  EXPECT_EQ(list_charts(charts, kEvenlyLit), "2-4,9");
  EXPECT_EQ(list_charts(charts, kUnlit), "0,6-7");
  for (const char* bad : {"10", "3-", "5-2", "1,,2", "1,", "x", "1 2", "-3"})
    EXPECT_FALSE(read_charts(bad, kUnlit, back)) << bad;
}

}  // namespace
}  // namespace kiln
