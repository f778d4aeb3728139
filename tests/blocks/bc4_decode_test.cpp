// The decoders of BC4 and BC5 against values worked out by hand from the specification, and against
// OpenImageIO's.
#include <algorithm>
#include <cstring>
#include <random>

#include "common/base/format.h"
#include "coordinator/output/blocks/bc4.h"
#include "coordinator/output/blocks/bc5.h"
#include "tests/blocks/foreign_decoder.h"

namespace kiln {
namespace {

// Ends, and the values of codes 0 to 7 times `parts`.
struct Row {
  uint8_t first, second;
  int value[8];
  int parts;
};

// Codes 0 to 7 twice, three bits each, from the lowest bit on.
constexpr uint8_t kCodes[6] = {0x88, 0xc6, 0xfa, 0x88, 0xc6, 0xfa};

constexpr Row kUnorm[] = {
    {200, 60, {200, 60, 180, 160, 140, 120, 100, 80}, 255},
    {255, 0, {7, 0, 6, 5, 4, 3, 2, 1}, 7},
    {1, 0, {7, 0, 6, 5, 4, 3, 2, 1}, 7 * 255},
    {60, 200, {60, 200, 88, 116, 144, 172, 0, 255}, 255},
    {0, 255, {0, 5, 1, 2, 3, 4, 0, 5}, 5},
    {254, 255, {1270, 1275, 1271, 1272, 1273, 1274, 0, 1275}, 5 * 255},
    {77, 77, {77, 77, 77, 77, 77, 77, 0, 255}, 255},
    {0, 0, {0, 0, 0, 0, 0, 0, 0, 1}, 1},
    {128, 127, {896, 889, 895, 894, 893, 892, 891, 890}, 7 * 255},  // told apart without sign
};

constexpr Row kSnorm[] = {
    {100, 216, {100, -40, 80, 60, 40, 20, 0, -20}, 127},           // 216: -40
    {216, 100, {-40, 100, -12, 16, 44, 72, -127, 127}, 127},       //
    {127, 129, {7, -7, 5, 3, 1, -1, -3, -5}, 7},                   // 129: -127
    {127, 128, {7, -7, 5, 3, 1, -1, -3, -5}, 7},                   // 128: -128, which is -127
    {128, 127, {-5, 5, -3, -1, 1, 3, -5, 5}, 5},                   //
    {129, 128, {-1, -1, -1, -1, -1, -1, -1, -1}, 1},               // eight values: -127 > -128
    {128, 128, {-1, -1, -1, -1, -1, -1, -1, 1}, 1},                //
    {0, 0, {0, 0, 0, 0, 0, 0, -127, 127}, 127},                    //
    {0, 255, {0, -7, -1, -2, -3, -4, -5, -6}, 7 * 127},            // 255: -1
    {255, 0, {-5, 0, -4, -3, -2, -1, -5 * 127, 5 * 127}, 5 * 127}  //
};

void expect_rows(std::span<const Row> rows, const char* one, const char* two) {
  for (const Row& row : rows) {
    uint8_t block[16] = {row.first, row.second};
    std::memcpy(block + 2, kCodes, 6);
    std::memset(block + 8, 0, 8);  // green: all of its first end, 0
    BlockTexels t;
    find_block_format(one)->decode(block, t);
    BlockTexels both;
    find_block_format(two)->decode(block, both);
    for (int i = 0; i < 16; ++i) {
      SCOPED_TRACE(text("{} {} {}, texel {}", one, row.first, row.second, i));
      const float red = static_cast<float>(row.value[i % 8]) / static_cast<float>(row.parts);
      EXPECT_EQ(t.rgba[i][0], red);
      EXPECT_EQ(t.rgba[i][1], 0.0f);
      EXPECT_EQ(t.rgba[i][2], 0.0f);
      EXPECT_EQ(t.rgba[i][3], 1.0f);
      EXPECT_EQ(std::memcmp(both.rgba[i], t.rgba[i], 16), 0);
    }
    // And as green.
    std::swap_ranges(block, block + 8, block + 8);
    find_block_format(two)->decode(block, both);
    for (int i = 0; i < 16; ++i) {
      EXPECT_EQ(both.rgba[i][0], 0.0f);
      EXPECT_EQ(both.rgba[i][1], t.rgba[i][0]);
    }
  }
}

TEST(Bc4Decode, ValuesOfTheSpecification) {
  expect_rows(kUnorm, "bc4", "bc5");
  expect_rows(kSnorm, "bc4_snorm", "bc5_snorm");
}

// Its values are bytes, however rounded: less than 1 from the fractions.
TEST(Bc4Decode, WithinAByteOfOpenImageIo) {
  std::mt19937 random(1);
  Bytes blocks(16 * 4096);
  for (std::byte& b : blocks) b = static_cast<std::byte>(random());
  for (const auto& [name, format] :
       {std::pair{"bc4", TextureFormat::kBc4Unorm}, {"bc5", TextureFormat::kBc5Unorm}}) {
    const BlockFormat& f = *find_block_format(name);
    const auto foreign = test::foreign_bytes(format, blocks);
    float most = 0;
    for (size_t b = 0; b < blocks.size() / f.bytes; ++b) {
      BlockTexels t;
      f.decode(reinterpret_cast<const uint8_t*>(&blocks[f.bytes * b]), t);
      for (size_t i = 0; i < 64; ++i)
        most = std::max(most, std::abs(255 * t.rgba[i / 4][i % 4] - static_cast<float>(foreign[64 * b + i])));
    }
    EXPECT_LT(most, 1.0f) << name;
  }
}

}  // namespace
}  // namespace kiln
