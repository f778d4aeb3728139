#include "common/pack/pack.h"

#include "tests/pack/painted.h"

namespace kiln {
namespace {
using namespace test;

// Rectangles, triangles and discs of mixed size, most of them small.
MaskSet random_masks(size_t count, uint32_t largest, uint64_t seed) {
  Random random(seed);
  MaskSet masks;
  for (size_t i = 0; i < count; ++i) {
    const double shrink = random.next() * random.next();
    const auto side = [&] { return 2 + static_cast<uint32_t>(shrink * random.next() * largest); };
    BitImage m(side(), side());
    const uint32_t right = m.width() - 1;
    for (uint32_t y = 0; y < m.height(); ++y) {
      const double t = (y + 0.5) / m.height();
      const auto inset = static_cast<uint32_t>((1 - std::sqrt(4 * t * (1 - t))) * 0.5 * right);
      if (i % 4 == 0)
        m.set_span(y, 0, static_cast<uint32_t>(t * right));
      else if (i % 4 == 1)
        m.set_span(y, inset, right - inset);
      else
        m.set_span(y, 0, right);
    }
    masks.add(m);
  }
  return masks;
}

MaskSet full_squares(uint32_t count, uint32_t side) {
  BitImage square(side, side);
  for (uint32_t y = 0; y < side; ++y) square.set_span(y, 0, side - 1);
  MaskSet masks;
  for (uint32_t i = 0; i < count; ++i) masks.add(square);
  return masks;
}

TEST(Pack, AllArePlacedAndNoneShareATexel) {
  for (uint64_t seed : {1, 2, 3}) {
    const MaskSet masks = random_masks(1500, 90, seed);
    const PackResult r = pack_all(masks, {});
    ASSERT_TRUE(r.fits);
    EXPECT_EQ(r.pages, 1u);
    const Painted painted(masks, r);
    EXPECT_EQ(painted.shared, 0u);
    EXPECT_EQ(painted.outside, 0u);
    EXPECT_EQ(painted.bits, painted.expected);
    EXPECT_GT(painted.share(), 0.88) << "seed " << seed;
    EXPECT_LT(r.width, 2 * r.height);
    EXPECT_LT(r.height, 2 * r.width);
    uint32_t turned = 0;
    for (const PackPlace& place : r.places) turned += place.turned;
    EXPECT_GT(turned, 200u);
    EXPECT_LT(turned, 1300u);
  }
}

// A strip much longer than the rest is wide lies along the rows of a low page.
TEST(Pack, APageIsAsWideAsItsLongestStrip) {
  for (const uint32_t height : {1u, 4u}) {
    MaskSet masks = full_squares(150, 9);  // two rows of them
    BitImage strip(700, height);
    for (uint32_t y = 0; y < height; ++y) strip.set_span(y, 0, 699);
    masks.add(strip);
    const PackResult r = pack_all(masks, {});
    const Painted painted(masks, r);
    EXPECT_EQ(painted.shared + painted.outside, 0u);
    EXPECT_GT(painted.share(), 0.85) << r.width << " x " << r.height;
  }
}

TEST(Pack, TheSameArgumentsGiveTheSamePlaces) {
  const MaskSet masks = random_masks(800, 60, 7);
  EXPECT_EQ(pack_all(masks, {}).places, pack_all(masks, {}).places);
}

TEST(Pack, TurningCanBeForbidden) {
  const MaskSet masks = random_masks(500, 60, 8);
  for (const PackPlace& place : pack_all(masks, {.turn = false}).places) EXPECT_FALSE(place.turned);
}

// The level of the published figures, smaller: 96 % there, and the fewer the charts the more the border
// costs.
TEST(Pack, AReducedLevelIsNinetySixPercentFull) {
  const MaskSet masks = make_level(published_level(), 26000, 1);
  const PackResult r = pack_all(masks, {});
  const Painted painted(masks, r);
  EXPECT_EQ(painted.shared, 0u);
  EXPECT_GE(painted.share(), 0.96);
}

TEST(Pack, CellsAreWholeOnThePage) {
  const MaskSet texels = random_masks(600, 90, 9);
  MaskSet cells;
  for (uint32_t i = 0; i < texels.size(); ++i) cells.add_reduced(texels[i], 4);
  const PackResult r = pack_all(cells, {.cell = 4});
  const Painted painted(cells, r, 4);
  EXPECT_EQ(painted.shared, 0u);
  EXPECT_EQ(painted.bits, painted.expected);
  EXPECT_EQ(r.width % 4, 0u);
  EXPECT_EQ(r.height % 4, 0u);
  for (const PackPlace& place : r.places) EXPECT_TRUE(place.x % 4 == 0 && place.y % 4 == 0);
}

// The bound of pack.h.
TEST(Pack, PagesAreBalanced) {
  const MaskSet masks = random_masks(1500, 90, 4);
  uint64_t largest = 0;
  for (uint32_t i = 0; i < masks.size(); ++i) largest = std::max(largest, masks[i].count());
  for (uint32_t side : {512u, 256u, 150u}) {
    const PackResult r = pack_all(masks, {.max_page_size = side});
    ASSERT_TRUE(r.fits);
    EXPECT_GT(r.pages, 1u);
    EXPECT_LE(std::max(r.width, r.height), side);
    const Painted painted(masks, r);
    EXPECT_EQ(painted.shared, 0u);
    const auto [least, most] = std::minmax_element(painted.by_page.begin(), painted.by_page.end());
    EXPECT_LE(*most - *least, largest) << side;
    EXPECT_GT(painted.share(), 0.75) << side;
  }
  EXPECT_FALSE(pack_all(masks, {.max_page_size = 128, .max_pages = 2}).fits);
}

TEST(Pack, SizesThatArePowersOfTwo) {
  for (uint32_t count : {3u, 40u, 1500u}) {
    const MaskSet masks = random_masks(count, 90, 5);
    for (uint32_t side : {2000u, 300u}) {
      const PackResult r = pack_all(masks, {.max_page_size = side, .power_of_two = true});
      ASSERT_TRUE(r.fits);
      EXPECT_TRUE(std::has_single_bit(r.width) && std::has_single_bit(r.height));
      EXPECT_LE(std::max(r.width, r.height), side);
      EXPECT_EQ(Painted(masks, r).shared, 0u);
    }
  }
}

TEST(Pack, FullSquaresFillThePage) {
  const MaskSet masks = full_squares(256, 16);
  const Painted painted(masks, pack_all(masks, {}));
  EXPECT_EQ(painted.shared, 0u);
  EXPECT_GT(painted.share(), 0.93);
}

TEST(Pack, OneMaskAndMasksOfAPageWidth) {
  const MaskSet one = full_squares(1, 64);
  const PackResult r = pack_all(one, {.max_page_size = 64});
  EXPECT_TRUE(r.fits);
  EXPECT_EQ(r.width, 64u);
  EXPECT_EQ(r.height, 64u);
  EXPECT_EQ(Painted(one, r).bits, 4096u);
  EXPECT_EQ(pack_all(full_squares(3, 64), {.max_page_size = 64}).pages, 3u);
}

TEST(Pack, SparseMasksMesh) {  // two diagonal stairs fit into each other's empty corners
  MaskSet masks;
  for (bool upper : {false, true}) {
    BitImage stairs(40, 40);
    for (uint32_t y = 0; y < 40; ++y) upper ? stairs.set_span(y, y, 39) : stairs.set_span(y, 0, y);
    masks.add(stairs);
  }
  const PackResult r = pack_all(masks, {});
  EXPECT_EQ(Painted(masks, r).shared, 0u);
  EXPECT_LE(r.width * r.height, 48u * 44u);
}

// A pack around earlier places.

PreviousPlaces previous_of(const PackResult& r) {
  PreviousPlaces previous{r.width, r.height, r.pages, {}};
  previous.places.assign(r.places.begin(), r.places.end());
  return previous;
}

MaskSet first_of(const MaskSet& masks, uint32_t count) {
  MaskSet first;
  for (uint32_t i = 0; i < count; ++i) first.add(masks[i]);
  return first;
}

TEST(PackAround, NewItemsMoveNone) {
  const MaskSet masks = random_masks(400, 60, 11);
  for (const PackSettings& settings :
       {PackSettings{}, PackSettings{.max_page_size = 128}, PackSettings{.power_of_two = true}}) {
    const PackResult before = pack_all(first_of(masks, 380), settings);
    const PreviousPlaces previous = previous_of(before);
    const PackResult after = pack_all(masks, settings, &previous);
    ASSERT_TRUE(after.fits);
    EXPECT_EQ(after.kept, 380u);
    EXPECT_TRUE(std::equal(before.places.begin(), before.places.end(), after.places.begin()));
    EXPECT_EQ(after.width, before.width);
    const Painted painted(masks, after);
    EXPECT_EQ(painted.shared, 0u);
    EXPECT_EQ(painted.bits, painted.expected);
    EXPECT_LE(after.height, settings.max_page_size);
  }
}

TEST(PackAround, OneRemovedMovesNoneAndItsPlaceIsUsedAgain) {
  const MaskSet masks = random_masks(300, 60, 12);
  const PackResult before = pack_all(masks, {});
  PreviousPlaces previous = previous_of(before);
  const size_t gone = 17;
  previous.places[gone].reset();
  const PackResult after = pack_all(masks, {}, &previous);
  EXPECT_EQ(after.kept, 299u);
  EXPECT_EQ(after.height, before.height);
  EXPECT_EQ(Painted(masks, after).shared, 0u);
}

TEST(PackAround, PlacesThatCannotBeAreNotKept) {
  const MaskSet masks = full_squares(6, 10);
  PreviousPlaces previous{100, 100, 1, {}};
  previous.places = {PackPlace{0, 0, 0},   PackPlace{5, 5, 0},           PackPlace{95, 0, 0},
                     PackPlace{0, 20, 77}, PackPlace{~0u, ~0u, 0, true}, PackPlace{20, 0, 0, true}};
  const PackResult r = pack_all(masks, {.max_page_size = 100}, &previous);
  EXPECT_TRUE(r.fits);
  EXPECT_EQ(r.kept, 2u);
  EXPECT_EQ(r.places[0], (PackPlace{0, 0, 0}));
  EXPECT_EQ(r.places[5], (PackPlace{20, 0, 0, true}));
  EXPECT_EQ(Painted(masks, r).shared, 0u);
  previous.width = previous.height = previous.pages = ~0u;
  EXPECT_TRUE(pack_all(masks, {.max_page_size = 100}, &previous).fits);
}

}  // namespace
}  // namespace kiln
