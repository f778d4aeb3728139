#include "common/raster/footprint.h"

#include <array>

#include "common/raster/bit_image.h"
#include "tests/atlas/shapes.h"

namespace kiln {
namespace {
using namespace test;

// The polygon cut by each side of the box in turn: does anything remain?
bool box_meets(const Triangle2& t, double x0, double y0, double x1, double y1) {
  std::vector<DVec2> polygon(t.c, t.c + 3);
  const std::array<std::array<double, 3>, 4> sides{{{1, 0, x0}, {-1, 0, -x1}, {0, 1, y0}, {0, -1, -y1}}};
  for (const auto& s : sides) {
    std::vector<DVec2> cut;
    for (size_t i = 0; i < polygon.size(); ++i) {
      const DVec2 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
      const double dp = s[0] * p.x + s[1] * p.y - s[2], dq = s[0] * q.x + s[1] * q.y - s[2];
      if (dp >= 0) cut.push_back(p);
      if ((dp >= 0) != (dq >= 0)) cut.push_back(p + (q - p) * (dp / (dp - dq)));
    }
    polygon = cut;
  }
  return !polygon.empty();
}

TEST(Footprint, EqualsBruteForce) {
  Random random(3);
  constexpr uint32_t kWidth = 24, kHeight = 20;
  for (int trial = 0; trial < 3000; ++trial) {
    Triangle2 t;
    const double size = trial % 3 == 0 ? 1.5 : 30;  // tiny ones too, and ones that leave the image
    const DVec2 base(random.next() * 26 - 3, random.next() * 22 - 3);
    for (DVec2& c : t.c) c = base + size * DVec2(random.next() - 0.5, random.next() - 0.5);
    if (trial % 7 == 0) t.c[2] = t.c[1];  // a line
    BitImage image(kWidth, kHeight);
    for_each_footprint_span(t, kWidth, kHeight,
                            [&](uint32_t y, uint32_t x0, uint32_t x1) { image.set_span(y, x0, x1); });
    const double e = kFootprintShrink;
    for (uint32_t y = 0; y < kHeight; ++y)
      for (uint32_t x = 0; x < kWidth; ++x)
        ASSERT_EQ(image.get(x, y), box_meets(t, x - 0.5 + e, y - 0.5 + e, x + 1.5 - e, y + 1.5 - e))
            << "trial " << trial << " texel " << x << ' ' << y;
  }
}

TEST(Footprint, BorderOnCentresClaimsNothingBeyond) {
  // Corners on the centres of texels 2 and 5: four texels a side.
  const Triangle2 t{{{2.5, 2.5}, {5.5, 2.5}, {5.5, 5.5}}};
  uint32_t least = 99, most = 0;
  for_each_footprint_span(t, 16, 16, [&](uint32_t y, uint32_t x0, uint32_t x1) {
    least = std::min({least, x0, y});
    most = std::max({most, x1, y});
  });
  EXPECT_EQ(least, 2u);
  EXPECT_EQ(most, 5u);
}

TEST(BitImage, SpansAndUnalignedReads) {
  Random random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const uint32_t width = 1 + random.below(200), a = random.below(width), b = a + random.below(width - a);
    BitImage image(width, 2);
    image.set_span(1, a, b);
    EXPECT_EQ(image.count(), b - a + 1);
    for (uint32_t x = 0; x < width; ++x) {
      EXPECT_EQ(image.get(x, 1), x >= a && x <= b);
      EXPECT_FALSE(image.get(x, 0));
      EXPECT_EQ(bits_from(image.row(1), x) & 1, image.get(x, 1));
      if (x + 63 < width) EXPECT_EQ(bits_from(image.row(1), x) >> 63, image.get(x + 63, 1));
    }
  }
}

}  // namespace
}  // namespace kiln
