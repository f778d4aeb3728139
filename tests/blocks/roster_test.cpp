// What every block format promises, over the roster.
#include <algorithm>

#include "tests/blocks/samples.h"

namespace kiln {
namespace {

// Values in [0, 1], which all formats hold.
std::vector<float> noise(size_t texels) {
  std::mt19937 random(10);
  std::vector<float> rgba(4 * texels);
  for (float& v : rgba) v = static_cast<float>(random() % 1000) / 999;
  return rgba;
}

TEST(BlockRoster, SameBytesForAnyNumberOfThreads) {
  const std::vector<float> rgba = noise(61 * 43);
  for (const BlockFormat& format : block_formats()) {
    const auto one = encode_blocks(format, {61, 43, rgba, {}}, {}, true, 1);
    const auto three = encode_blocks(format, {61, 43, rgba, {}}, {}, true, 3);
    ASSERT_TRUE(one && three) << format.name;
    EXPECT_EQ(*one, *three) << format.name;
    EXPECT_EQ(one->size(), blocks_bytes(format, 61, 43)) << format.name;
  }
}

// A coded channel of noise comes back nearer than its mean would be; others are constant.
TEST(BlockRoster, ChannelsAreThoseThatAreCoded) {
  const std::vector<float> rgba = noise(size_t{32} * 32);
  for (const BlockFormat& format : block_formats()) {
    BlockChoice choice;
    choice.alpha = format.channels == 4;
    const auto out = decode_blocks(format, *encode_blocks(format, {32, 32, rgba, {}}, choice), 32, 32);
    ASSERT_TRUE(out) << format.name;
    for (size_t c = 0; c < 4; ++c) {
      double squares = 0;
      for (size_t t = 0; t < 32 * 32; ++t) {
        if (c >= format.channels) EXPECT_EQ((*out)[4 * t + c], c == 3 ? 1.0f : 0.0f) << format.name << c;
        const double d = double{(*out)[4 * t + c]} - rgba[4 * t + c];
        squares += d * d / (32 * 32);
      }
      // 1/12: the variance of the noise.
      if (c < format.channels) EXPECT_LT(squares, 1.0 / 12) << format.name << c;
    }
  }
}

TEST(BlockRoster, EmptyBlocksAndAnySize) {
  for (const BlockFormat& format : block_formats())
    for (const auto& [width, height] : {std::pair{1u, 1u}, {3u, 5u}, {9u, 4u}}) {
      SCOPED_TRACE(format.name);
      const std::vector<float> rgba(size_t{4} * width * height, 1.0f), weight(size_t{width} * height, 0.0f);
      const auto empty = encode_blocks(format, {width, height, rgba, weight}, {});
      ASSERT_TRUE(empty);
      const auto out = decode_blocks(format, *empty, width, height);
      ASSERT_TRUE(out);
      for (size_t i = 0; i < out->size(); ++i) EXPECT_EQ((*out)[i], i % 4 == 3 ? 1.0f : 0.0f);
      const auto full = encode_blocks(format, {width, height, rgba, {}}, {});
      ASSERT_TRUE(full);
      const auto back = decode_blocks(format, *full, width, height);
      ASSERT_TRUE(back);
      for (size_t i = 0; i < back->size(); ++i)  // 1 is a value of every format
        EXPECT_EQ((*back)[i], i % 4 < format.channels || i % 4 == 3 ? 1.0f : 0.0f);
      EXPECT_FALSE(decode_blocks(format, std::span(*full).first(full->size() - 1), width, height));
    }
}

}  // namespace
}  // namespace kiln
