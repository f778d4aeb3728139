// The decoder of BC7 against OpenImageIO's, bit for bit.
#include <cstring>
#include <random>

#include "coordinator/output/blocks/bc7.h"
#include "tests/blocks/foreign_decoder.h"

namespace kiln {
namespace {

void expect_same(const Bytes& blocks) {
  const auto foreign = test::foreign_bytes(TextureFormat::kBc7Unorm, blocks);
  size_t wrong = 0;
  for (size_t b = 0; b < blocks.size() / 16; ++b) {
    BlockTexels t;
    decode_bc7(reinterpret_cast<const uint8_t*>(&blocks[16 * b]), t);
    for (size_t i = 0; i < 64; ++i)
      wrong += t.rgba[i / 4][i % 4] != static_cast<float>(foreign[64 * b + i]) / 255.0f;
  }
  EXPECT_EQ(wrong, 0u);
}

// Sets `bits` of a block.
void put(std::byte* block, int first, int bits, unsigned value) {
  for (int i = 0; i < bits; ++i) {
    const int at = first + i;
    block[at / 8] &= ~static_cast<std::byte>(1 << at % 8);
    block[at / 8] |= static_cast<std::byte>((value >> i & 1) << at % 8);
  }
}

TEST(Bc7Decode, RandomBlocksOfEveryModeAndHeader) {
  // Bits behind the mode: partition; or rotation and selector. All their values, 16 blocks each.
  const int header_bits[8] = {4, 6, 6, 6, 3, 2, 0, 6};
  std::mt19937 random(7);
  Bytes blocks;
  for (int mode = 0; mode < 8; ++mode)
    for (unsigned header = 0; header < 1u << header_bits[mode]; ++header)
      for (int n = 0; n < 16; ++n) {
        std::byte block[16];
        for (std::byte& b : block) b = static_cast<std::byte>(random());
        put(block, 0, mode + 1, 1u << mode);
        put(block, mode + 1, header_bits[mode], header);
        blocks.insert(blocks.end(), block, block + 16);
      }
  expect_same(blocks);
}

TEST(Bc7Decode, EdgesOfEveryMode) {
  Bytes blocks;
  for (int mode = 0; mode < 8; ++mode)
    for (const unsigned fill : {0u, 0xffu, 0x55u, 0xaau, 0x0fu, 0xf0u})
      for (unsigned header = 0; header < 64; ++header) {
        std::byte block[16];
        std::fill_n(block, 16, static_cast<std::byte>(fill));
        put(block, 0, mode + 1, 1u << mode);
        put(block, mode + 1, 6, header);
        blocks.insert(blocks.end(), block, block + 16);
      }
  expect_same(blocks);
}

TEST(Bc7Decode, EverySingleBit) {
  Bytes blocks;
  for (int mode = 0; mode < 8; ++mode)
    for (int bit = mode + 1; bit < 128; ++bit) {
      std::byte block[16] = {};
      put(block, 0, mode + 1, 1u << mode);
      put(block, bit, 1, 1);
      blocks.insert(blocks.end(), block, block + 16);
    }
  expect_same(blocks);
}

TEST(Bc7Decode, NoModeIsTransparentBlack) {
  std::mt19937 random(9);
  Bytes blocks(16 * 64);
  for (std::byte& b : blocks) b = static_cast<std::byte>(random());
  for (size_t b = 0; b < 64; ++b) blocks[16 * b] = std::byte{0};
  expect_same(blocks);
  BlockTexels t;
  decode_bc7(reinterpret_cast<const uint8_t*>(blocks.data()), t);
  for (const auto& texel : t.rgba)
    for (const float v : texel) EXPECT_EQ(v, 0.0f);
}

}  // namespace
}  // namespace kiln
