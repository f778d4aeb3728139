// Our decoder against OpenImageIO's, bit for bit, and against the specification where that one has an opinion
// of its own.
#include <bit>
#include <cstring>
#include <random>

#include "coordinator/output/blocks/bc6h.h"
#include "coordinator/output/blocks/bc6h_block.h"
#include "tests/blocks/foreign_decoder.h"

namespace kiln {
namespace {
using RawBlock = std::array<uint8_t, 16>;

std::string hex(const RawBlock& block) {
  std::string text;
  char two[3];
  for (const uint8_t byte : block) std::snprintf(two, sizeof two, "%02x", byte), text += two;
  return text;
}

// Every block's values, compared as bits; zeros of either sign are the same.
void expect_same(bool is_signed, const std::vector<RawBlock>& blocks) {
  Bytes bytes(16 * blocks.size());
  std::memcpy(bytes.data(), blocks.data(), bytes.size());
  const std::vector<float> foreign =
      test::foreign_floats(is_signed ? TextureFormat::kBc6hSfloat : TextureFormat::kBc6hUfloat, bytes);
  ASSERT_EQ(foreign.size(), 64 * blocks.size());
  size_t different = 0;
  for (size_t b = 0; b < blocks.size(); ++b) {
    BlockTexels ours{};
    (is_signed ? decode_bc6h_sfloat : decode_bc6h_ufloat)(blocks[b].data(), ours);
    bool same = true;
    for (size_t i = 0; i < 64; ++i)
      same &= std::bit_cast<uint32_t>(ours.rgba[i / 4][i % 4] + 0.0f) ==
              std::bit_cast<uint32_t>(foreign[64 * b + i] + 0.0f);
    if (!same && ++different < 5) ADD_FAILURE() << "block " << hex(blocks[b]);
  }
  EXPECT_EQ(different, 0u) << "of " << blocks.size();
}

constexpr uint8_t kCodes[] = {0, 1, 2, 6, 10, 14, 18, 22, 26, 30, 3, 7, 11, 15, 19, 23, 27, 31};

void set_code(RawBlock& block, uint8_t code) {
  const uint8_t mask = code < 2 ? 3 : 31;
  block[0] = static_cast<uint8_t>((block[0] & ~mask) | code);
}

void set_partition(RawBlock& block, uint32_t partition) {  // bits 77 to 81
  block[9] = static_cast<uint8_t>((block[9] & 0x1F) | partition << 5);
  block[10] = static_cast<uint8_t>((block[10] & ~3) | partition >> 3);
}

RawBlock random_block(std::mt19937_64& random) {
  RawBlock block;
  for (int i = 0; i < 2; ++i) {
    const uint64_t bits = random();
    std::memcpy(&block[8 * i], &bits, 8);
  }
  return block;
}

// Each of 18 codes (four are reserved) with each of 32 partitions, 24 times: 13824 blocks.
std::vector<RawBlock> random_blocks() {
  std::mt19937_64 random(6);
  std::vector<RawBlock> blocks;
  for (const uint8_t code : kCodes)
    for (uint32_t partition = 0; partition < 32; ++partition)
      for (int i = 0; i < 24; ++i) {
        blocks.push_back(random_block(random));
        set_code(blocks.back(), code);
        set_partition(blocks.back(), partition);
      }
  return blocks;
}

// Bits all zero, all one, one alone, one missing; end points at their limits and differences that wrap.
std::vector<RawBlock> edge_blocks() {
  std::mt19937_64 random(7);
  std::vector<RawBlock> blocks;
  for (const uint8_t code : kCodes) {
    for (int bit = -1; bit < 128; ++bit)
      for (const uint8_t ground : {0x00, 0xFF}) {
        RawBlock block;
        block.fill(ground);
        if (bit >= 0) block[bit / 8] ^= static_cast<uint8_t>(1 << bit % 8);
        set_code(block, code);
        blocks.push_back(block);
      }
    for (int i = 0; i < 400; ++i) {  // sparse and dense: fields that are all ones or zeros
      RawBlock a = random_block(random);
      for (int round = 0; round < 2; ++round) {
        const RawBlock b = random_block(random);
        for (int k = 0; k < 16; ++k) a[k] = i % 2 ? a[k] & b[k] : a[k] | b[k];
      }
      set_code(a, code);
      blocks.push_back(a);
    }
  }
  return blocks;
}

TEST(Bc6hDecode, RandomBlocksAsOpenImageIo) {
  expect_same(false, random_blocks());
  expect_same(true, random_blocks());
}

TEST(Bc6hDecode, EdgeBlocksAsOpenImageIo) {
  expect_same(false, edge_blocks());
  expect_same(true, edge_blocks());
}

// The specification: reserved modes are 0 in colour and 1 in alpha.
TEST(Bc6hDecode, ReservedModesAreBlack) {
  std::mt19937_64 random(8);
  for (const uint8_t code : {19, 23, 27, 31})
    for (int i = 0; i < 50; ++i) {
      RawBlock block = random_block(random);
      set_code(block, code);
      for (const auto decode : {decode_bc6h_ufloat, decode_bc6h_sfloat}) {
        BlockTexels texels;
        decode(block.data(), texels);
        for (const auto& texel : texels.rgba)
          EXPECT_TRUE(texel[0] == 0 && texel[1] == 0 && texel[2] == 0 && texel[3] == 1);
      }
    }
}

// What unpack() reads, pack() writes: no bit of any mode is lost or moved. (Reserved modes apart; anchors
// have no upper bit to lose.)
TEST(Bc6hBlock, PackIsTheInverseOfUnpack) {
  for (const bool is_signed : {false, true})
    for (const auto& blocks : {random_blocks(), edge_blocks()})
      for (const RawBlock& raw : blocks) {
        const bc6h::Block block = bc6h::unpack(raw.data(), is_signed);
        if (block.mode < 0) continue;
        EXPECT_TRUE(bc6h::fits(block, 0, is_signed)) << hex(raw);
        RawBlock again;
        bc6h::pack(block, again.data());
        ASSERT_EQ(hex(raw), hex(again));
      }
}

}  // namespace
}  // namespace kiln
