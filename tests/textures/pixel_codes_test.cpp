// Codes of single texels: what they hold, and what they lose.
#include "coordinator/output/textures/pixel_codes.h"

#include <bit>

#include "common/base/files.h"
#include "coordinator/output/textures/radiance.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/atlas/shapes.h"

namespace kiln::test {
namespace {

TEST(PixelCodes, EveryHalfReadsBackAndBetweenTwoGoesToTheNearestOrTheEven) {
  for (uint32_t bits = 0; bits < 0x7C00; ++bits) {
    const float value = from_half(static_cast<uint16_t>(bits));
    ASSERT_EQ(to_half(value), bits);
    ASSERT_EQ(to_half(-value), bits | 0x8000u);
    if (bits == 0x7BFF) break;
    const float next = from_half(static_cast<uint16_t>(bits + 1)), middle = (value + next) / 2;
    ASSERT_EQ(to_half(middle), bits % 2 ? bits + 1 : bits) << bits;
    ASSERT_EQ(to_half(std::nextafter(middle, 0.0f)), bits);
    ASSERT_EQ(to_half(std::nextafter(middle, next)), bits + 1);
  }
  EXPECT_EQ(from_half(0x7BFF), 65504.0f);
  EXPECT_EQ(from_half(0x0001), 0x1p-24f);
  EXPECT_EQ(to_half(1e9f), 0x7BFF);
  EXPECT_TRUE(std::isinf(from_half(0x7C00)));
  EXPECT_TRUE(std::isnan(from_half(0x7C01)));
}

// The largest channel has 9 bits of which the first is set (or one less after a carry): a step is 2^-8 of it
// at most, so every channel is within 2^-9 of the largest.
TEST(PixelCodes, SharedExponentIsWithinHalfAStep) {
  Random random(1);
  for (int i = 0; i < 200'000; ++i) {
    const double scale = std::exp2(30 * random.next() - 14.5);
    float rgb[3], back[3];
    for (float& v : rgb) v = static_cast<float>(scale * random.next());
    from_rgb9e5(to_rgb9e5(rgb), back);
    const float most = std::max({rgb[0], rgb[1], rgb[2]});
    // Below 2^-16 the exponent has ended: steps are 2^-24.
    const double step = std::max(double{most} / 512 * (1 + 1e-6), 0x1p-25);
    for (int c = 0; c < 3; ++c) ASSERT_LE(std::abs(back[c] - std::min(rgb[c], 65408.0f)), step) << most;
  }
  const float edges[][3] = {{65408, 0, 0}, {1e9f, 1, 0}, {-1, NAN, 0}, {0, 0, 0}, {0x1p-24f, 0, 0}};
  const float want[][3] = {{65408, 0, 0}, {65408, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0x1p-24f, 0, 0}};
  for (int i = 0; i < 5; ++i) {
    float back[3];
    from_rgb9e5(to_rgb9e5(edges[i]), back);
    for (int c = 0; c < 3; ++c) EXPECT_EQ(back[c], want[i][c]) << i;
  }
}

// What each code may lose at a value of the largest channel `most` in channel c.
double allowed(Unpack unpack, double value, double most) {
  switch (unpack) {
    case Unpack::kNone:
      return 0.5 / 255;
    case Unpack::kSrgb: {  // half a step of the coded value, by the curve's steepest slope near it
      const double slope =
          2.4 / 1.055 * std::pow((std::pow(value, 1 / 2.4) * 1.055 + 0.5 / 255) / 1.055, 1.4);
      return 0.5 / 255 * std::max(slope, 1 / 12.92) * 1.02;
    }
    case Unpack::kRgbe:
      return most / 255;  // mantissas of the largest are 127.5 at least: steps are 1/127.5 of it
    case Unpack::kRgbm: {
      // sqrt(v) = 8 a c, c in steps of 1/255, a at most one step above what the largest needs.
      const double a = std::min(1.0, std::sqrt(most) / 8 + 1.0 / 255), root = 8 * a * 0.5 / 255;
      return 2 * std::sqrt(value) * root + root * root + 1e-7;
    }
    case Unpack::kRgbd: {
      const double a = std::clamp(std::floor(255 / std::max(most, 1e-12)), 1.0, 255.0) / 255;
      const double c = std::min(1.0, std::pow(value * a, 1 / 2.2) + 0.5 / 255);
      return (std::pow(c, 1.2) * 2.2 * 0.5 / 255) / a * 1.001 + 1e-7;
    }
  }
  return 0;
}

TEST(PixelCodes, PackedColoursAreWithinHalfAStep) {
  Random random(2);
  for (const Unpack unpack : {Unpack::kNone, Unpack::kSrgb, Unpack::kRgbe, Unpack::kRgbm, Unpack::kRgbd})
    for (int i = 0; i < 50'000; ++i) {
      const double limit = std::min(1000.0f, unpack_most(unpack)),
                   scale = limit * std::exp2(-12 * random.next());
      float rgb[3], c[4], back[3];
      for (float& v : rgb) v = static_cast<float>(scale * random.next());
      uint8_t bytes[4];
      pack_texel(unpack, rgb, bytes);
      for (int k = 0; k < 4; ++k) c[k] = bytes[k] / 255.0f;
      unpack_texel(unpack, c, back);
      const double most = std::max({rgb[0], rgb[1], rgb[2]});
      for (int k = 0; k < 3; ++k)
        ASSERT_LE(std::abs(back[k] - rgb[k]), allowed(unpack, rgb[k], most) * (1 + 1e-5) + 1e-9)
            << unpack_name(unpack) << " " << rgb[k] << " of " << most;
    }
}

TEST(PixelCodes, BlackIsBlack) {
  for (const Unpack unpack : {Unpack::kNone, Unpack::kSrgb, Unpack::kRgbe, Unpack::kRgbm, Unpack::kRgbd}) {
    const float black[3] = {0, 0, 0};
    uint8_t bytes[4];
    float c[4], back[3];
    pack_texel(unpack, black, bytes);
    for (int k = 0; k < 4; ++k) c[k] = bytes[k] / 255.0f;
    unpack_texel(unpack, c, back);
    for (const float v : back) EXPECT_EQ(v, 0.0f) << unpack_name(unpack);
  }
}

// Any width, runs and none, read by OpenImageIO.
TEST(Radiance, TexelsComeBackBitForBit) {
  Random random(3);
  TempDir dir;
  for (const uint32_t width : {1u, 7u, 8u, 9u, 130u, 300u})
    for (const int kind : {0, 1, 2}) {
      const uint32_t height = 3;
      Bytes rgbe(4 * size_t{width} * height);
      for (size_t i = 0; i < rgbe.size(); ++i) {
        const bool exponent = i % 4 == 3;
        const uint32_t value = kind == 0              ? 7
                               : kind == 1            ? random.below(256)
                               : random.below(8) == 0 ? i / 4 % 250
                                                      : 9;
        rgbe[i] = static_cast<std::byte>(exponent ? 120 + value % 16 : value);
      }
      const std::filesystem::path path = dir.path() / "a.hdr";
      ASSERT_TRUE(write_file_atomic(path, write_radiance(width, height, rgbe)));
      const auto image = read_environment(path);
      ASSERT_TRUE(image) << image.error().message;
      ASSERT_EQ(image->width, width);
      ASSERT_EQ(image->height, height);
      for (size_t t = 0; t < size_t{width} * height; ++t) {
        float got[3], want[3], c[4];
        std::memcpy(got, &image->texels[12 * t], sizeof got);
        for (size_t k = 0; k < 4; ++k) c[k] = static_cast<float>(std::to_integer<int>(rgbe[4 * t + k])) / 255;
        unpack_texel(Unpack::kRgbe, c, want);
        for (size_t k = 0; k < 3; ++k) ASSERT_NEAR(got[k], want[k], 1e-6f * want[k]) << width << " " << kind;
      }
    }
}

}  // namespace
}  // namespace kiln::test
