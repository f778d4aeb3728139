#include "common/pack/mask_set.h"

#include "tests/pack/painted.h"

namespace kiln {
namespace {
using namespace test;

BitImage some_bits(uint32_t width, uint32_t height, uint64_t seed) {
  Random random(seed);
  BitImage mask(width, height);
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x)
      if (random.next() < 0.3) mask.set_span(y, x, x);
  return mask;
}

TEST(MaskSet, TurnedByNinetyDegreesAndNotMirrored) {
  for (const auto& [w, h] : {std::pair{5u, 3u}, {64u, 65u}, {130u, 7u}, {1u, 200u}}) {
    MaskSet set, turned;
    set.add(some_bits(w, h, w));
    turned.add_turned(set[0]);
    ASSERT_EQ(turned[0].width, h);
    ASSERT_EQ(turned[0].height, w);
    for (uint32_t y = 0; y < h; ++y)
      for (uint32_t x = 0; x < w; ++x) EXPECT_EQ(set[0].get(x, y), turned[0].get(h - 1 - y, x));
  }
}

TEST(MaskSet, ReducedCellsHoldAnyOfTheirBits) {
  MaskSet set, cells;
  set.add(some_bits(131, 70, 3));
  cells.add_reduced(set[0], 4);
  ASSERT_EQ(cells[0].width, 33u);
  ASSERT_EQ(cells[0].height, 18u);
  for (uint32_t cy = 0; cy < 18; ++cy)
    for (uint32_t cx = 0; cx < 33; ++cx) {
      bool any = false;
      for (uint32_t y = 4 * cy; y < std::min(70u, 4 * cy + 4); ++y)
        for (uint32_t x = 4 * cx; x < std::min(131u, 4 * cx + 4); ++x) any |= set[0].get(x, y);
      EXPECT_EQ(cells[0].get(cx, cy), any);
    }
}

TEST(MaskSet, AppendedMasksAreTheSame) {
  MaskSet first, second;
  first.add(some_bits(9, 4, 1));
  second.add(some_bits(70, 5, 2));
  const MaskSet copy = second;
  first.append(second);
  ASSERT_EQ(first.size(), 2u);
  for (uint32_t y = 0; y < 5; ++y)
    for (uint32_t x = 0; x < 70; ++x) EXPECT_EQ(first[1].get(x, y), copy[0].get(x, y));
}

}  // namespace
}  // namespace kiln
