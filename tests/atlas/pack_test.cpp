#include "common/pack/pack.h"

#include "tests/atlas/shapes.h"

namespace kiln {
namespace {
using namespace test;

// Rectangles, triangles and discs of mixed size, most of them small.
std::vector<BitImage> random_masks(size_t count, uint32_t largest, uint64_t seed) {
  Random random(seed);
  std::vector<BitImage> masks;
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
    masks.push_back(std::move(m));
  }
  return masks;
}

std::vector<const BitImage*> pointers(const std::vector<BitImage>& masks) {
  std::vector<const BitImage*> p;
  for (const BitImage& m : masks) p.push_back(&m);
  return p;
}

// Texels of all placed masks; fails the test if two share one or one lies outside.
uint64_t paint(const std::vector<BitImage>& masks, const PackResult& r) {
  std::vector<uint8_t> taken(size_t{r.width} * r.height * r.pages);
  uint64_t texels = 0, shared = 0;
  for (size_t i = 0; i < masks.size(); ++i)
    for (uint32_t y = 0; y < masks[i].height(); ++y)
      for (uint32_t x = 0; x < masks[i].width(); ++x) {
        if (!masks[i].get(x, y)) continue;
        const PackPlace& p = r.places[i];
        EXPECT_TRUE(p.x + x < r.width && p.y + y < r.height && p.page < r.pages);
        shared += taken[(size_t{p.page} * r.height + p.y + y) * r.width + p.x + x]++;
        ++texels;
      }
  EXPECT_EQ(shared, 0u);
  return texels;
}

TEST(Pack, AllArePlacedAndNoneShareATexel) {
  for (uint64_t seed : {1, 2, 3}) {
    const auto masks = random_masks(1500, 90, seed);
    const PackResult r = pack_masks(pointers(masks), {});
    ASSERT_TRUE(r.fits);
    EXPECT_EQ(r.pages, 1u);
    const double used = static_cast<double>(paint(masks, r)) / (double{1.0} * r.width * r.height);
    EXPECT_GT(used, 0.85) << "seed " << seed;
    EXPECT_LT(r.width, 2 * r.height);
    EXPECT_LT(r.height, 2 * r.width);
  }
}

TEST(Pack, ASmallPageMakesMorePagesOfOneSize) {
  const auto masks = random_masks(1500, 90, 4);
  const PackResult r = pack_masks(pointers(masks), {.max_page_size = 128});
  ASSERT_TRUE(r.fits);
  EXPECT_GT(r.pages, 3u);
  EXPECT_LE(r.width, 128u);
  EXPECT_LE(r.height, 128u);
  paint(masks, r);
  EXPECT_FALSE(pack_masks(pointers(masks), {.max_page_size = 128, .max_pages = 2}).fits);
}

TEST(Pack, FullRectanglesFillThePage) {
  std::vector<BitImage> masks(256, BitImage(16, 16));
  for (BitImage& m : masks)
    for (uint32_t y = 0; y < 16; ++y) m.set_span(y, 0, 15);
  const PackResult r = pack_masks(pointers(masks), {});
  EXPECT_GT(static_cast<double>(paint(masks, r)) / (double{1.0} * r.width * r.height), 0.9);
}

TEST(Pack, OneMaskAndMasksOfAPageWidth) {
  std::vector<BitImage> one(1, BitImage(64, 64));
  for (uint32_t y = 0; y < 64; ++y) one[0].set_span(y, 0, 63);
  const PackResult r = pack_masks(pointers(one), {.max_page_size = 64});
  EXPECT_TRUE(r.fits);
  EXPECT_EQ(r.width, 64u);
  EXPECT_EQ(r.height, 64u);
  EXPECT_EQ(paint(one, r), 4096u);
}

TEST(Pack, SparseMasksMesh) {  // two diagonal stairs fit into each other's empty corners
  std::vector<BitImage> masks(2, BitImage(40, 40));
  for (uint32_t y = 0; y < 40; ++y) {
    masks[0].set_span(y, 0, y);
    masks[1].set_span(y, y, 39);
  }
  const PackResult r = pack_masks(pointers(masks), {});
  paint(masks, r);
  EXPECT_LE(r.width * r.height, 48u * 44u);
}

}  // namespace
}  // namespace kiln
