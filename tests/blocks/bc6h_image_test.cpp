// BC6H through encode_blocks() and decode_blocks(): ranges, borders, fill, threads.
#include <cmath>
#include <limits>

#include "coordinator/output/blocks/bc6h.h"
#include "tests/blocks/bc6h_maker.h"

namespace kiln {
namespace {
using namespace test;

struct Picture {
  uint32_t width, height;
  std::vector<float> rgba, weight;
  Picture(uint32_t w, uint32_t h, float value = 1) : width(w), height(h), rgba(size_t{4} * w * h, value) {}
  BlockImage image() const { return {width, height, rgba, weight}; }
};

const BlockFormat& format_of(bool is_signed) {
  return *find_block_format(is_signed ? "bc6h_sfloat" : "bc6h_ufloat");
}

std::vector<float> through(const Picture& picture, bool is_signed, bool fill = true) {
  const BlockFormat& format = format_of(is_signed);
  const Expected<Bytes> blocks = encode_blocks(format, picture.image(), {}, fill);
  EXPECT_TRUE(blocks) << blocks.error().message;
  EXPECT_EQ(blocks->size(), blocks_bytes(format, picture.width, picture.height));
  return *decode_blocks(format, *blocks, picture.width, picture.height);
}

// Light, a plane a block, and a quarter of the texels without weight. Rough: up to four stops over a block.
Picture patchwork(uint32_t size, bool rough) {
  std::mt19937 random(11);
  Picture picture(size, size);
  picture.weight.assign(size_t{size} * size, 1);
  for (uint32_t by = 0; by < size; by += 4)
    for (uint32_t bx = 0; bx < size; bx += 4) {
      const BlockTexels block =
          smooth_block(random, rough && bx % 8 ? 4.0f : 0.3f, rough && by % 8 ? 0.5f : 0.01f);
      for (uint32_t i = 0; i < 16; ++i) {
        const size_t texel = size_t{by + i / 4} * size + bx + i % 4;
        std::copy_n(block.rgba[i], 4, &picture.rgba[4 * texel]);
        if (random() % 4 == 0) picture.weight[texel] = 0;
      }
    }
  return picture;
}

TEST(Bc6hImage, AnySizeKeepsItsTexels) {
  for (const auto& [w, h] : {std::pair{1u, 1u}, {3u, 5u}, {4u, 4u}, {5u, 1u}, {1u, 9u}, {17u, 6u}})
    for (const bool is_signed : {false, true}) {
      Picture picture(w, h);
      for (uint32_t y = 0; y < h; ++y)  // a value for each block: any texel out of place shows
        for (uint32_t x = 0; x < w; ++x)
          for (uint32_t c = 0; c < 3; ++c)
            picture.rgba[4 * (y * w + x) + c] =
                value_of_half(int(0x2000 + 97 * (x / 4) + 1031 * (y / 4) + c));
      EXPECT_EQ(through(picture, is_signed), picture.rgba) << w << 'x' << h;
    }
}

TEST(Bc6hImage, SpecialValues) {
  const struct {
    float in, as_unsigned, as_signed;
  } cases[] = {
      {0, 0, 0},
      {-0.0f, 0, 0},
      {kLargestHalf, kLargestHalf, kLargestHalf},
      {-kLargestHalf, 0, -kLargestHalf},
      {70000, kLargestHalf, kLargestHalf},
      {std::numeric_limits<float>::max(), kLargestHalf, kLargestHalf},
      {-1e30f, 0, -kLargestHalf},
      {0x1p-24f, 0x1p-24f, 0x1p-24f},  // the least half
      {-0x1p-24f, 0, -0x1p-24f},
      {0x1.ff8p-15f, 0x1.ff8p-15f, 0x1.ff8p-15f},  // the largest half that is denormal
      {1e-30f, 0, 0},
      {-0.125f, 0, -0.125f},
  };
  for (const auto& c : cases) {
    const Picture picture(4, 4, c.in);
    EXPECT_EQ(through(picture, false)[0], c.as_unsigned) << c.in;
    EXPECT_EQ(through(picture, true)[0], c.as_signed) << c.in;
  }
}

TEST(Bc6hImage, WhatIsNotFiniteIsNamed) {
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Picture picture(9, 6);
    picture.rgba[4 * (5 * 9 + 7) + 1] = value;
    picture.rgba[4 * (3 * 9 + 8) + 2] = value;
    const Expected<Bytes> blocks = encode_blocks(format_of(false), picture.image(), {});
    ASSERT_FALSE(blocks);
    EXPECT_EQ(blocks.error().kind, ErrorKind::kInvalidInput);
    EXPECT_NE(blocks.error().message.find("texel 8, 3 "), std::string::npos) << blocks.error().message;
    picture.weight.assign(54, 1);  // of nobody's texels it is no matter
    picture.weight[5 * 9 + 7] = picture.weight[3 * 9 + 8] = 0;
    EXPECT_TRUE(encode_blocks(format_of(false), picture.image(), {}));
  }
}

TEST(Bc6hImage, EmptyBlocksAreBlack) {
  Picture picture(8, 4, 3);
  picture.weight.assign(32, 0);
  picture.weight[2] = 1;  // the left block has one texel
  const std::vector<float> got = through(picture, false);
  for (size_t i = 0; i < 32; ++i) EXPECT_EQ(got[4 * i], i % 8 < 4 ? 3.0f : 0.0f);
}

// Black texels of nobody stretch a block's levels from a third of a stop down to 0, fifteen stops below;
// filled ones do not. Even if partitions save one block in two, half the blocks have a hundred times the
// squares.
TEST(Bc6hImage, FillKeepsLevelsForTexelsThatCount) {
  const Picture picture = [] {
    Picture made = patchwork(64, false);
    for (size_t i = 0; i < made.weight.size(); ++i)
      if (made.weight[i] == 0) std::fill_n(&made.rgba[4 * i], 3, 0.0f);
    return made;
  }();
  double squares[2] = {};
  for (const bool fill : {false, true}) {
    const std::vector<float> got = through(picture, false, fill);
    for (size_t i = 0; i < picture.weight.size(); ++i)
      for (size_t c = 0; c < 3; ++c)
        if (picture.weight[i] > 0)
          squares[fill] += std::pow(step_of(got[4 * i + c]) - step_of(picture.rgba[4 * i + c]), 2);
  }
  EXPECT_LT(squares[1], 0.2 * squares[0]);
}

TEST(Bc6hImage, ThreadsChangeNoByte) {
  const Picture picture = patchwork(64, true);
  for (const bool is_signed : {false, true})
    for (const BlockMetric metric : {BlockMetric::kLinear, BlockMetric::kLog, BlockMetric::kPerceptual}) {
      const BlockChoice choice{BlockEffort::kNormal, metric};
      const Bytes one = *encode_blocks(format_of(is_signed), picture.image(), choice, true, 1);
      EXPECT_EQ(one, *encode_blocks(format_of(is_signed), picture.image(), choice, true, 7));
      EXPECT_EQ(one, *encode_blocks(format_of(is_signed), picture.image(), choice, true, 1));
    }
}

}  // namespace
}  // namespace kiln
