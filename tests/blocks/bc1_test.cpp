// BC1: the decoder against OpenImageIO's, bit for bit, and the encoder.
#include "coordinator/output/blocks/bc1.h"

#include <algorithm>
#include <cstring>

#include "tests/blocks/foreign_decoder.h"
#include "tests/blocks/samples.h"

namespace kiln {
namespace {

using test::round_trip;
using test::sample_block;
using test::squared_error;

constexpr BlockEffort kEfforts[] = {BlockEffort::kFast, BlockEffort::kNormal, BlockEffort::kBest};

const BlockFormat& bc1() {
  return *find_block_format("bc1");
}

TEST(Bc1, DecodesAsOpenImageIo) {
  std::mt19937 random(1);
  Bytes blocks(8 * 8192);
  for (std::byte& b : blocks) b = static_cast<std::byte>(random());
  for (size_t b = 0; b < 64; ++b) std::memcpy(&blocks[8 * b], &blocks[8 * b + 2], 2);  // equal ends
  // Every pair of ends of 5 bits, and of 6 bits, with the four codes.
  for (unsigned a = 0; a < 64; ++a)
    for (unsigned b = 0; b < 64; ++b) {
      const unsigned first = (a / 2) << 11 | a << 5 | a / 2, second = (b / 2) << 11 | b << 5 | b / 2;
      const uint32_t words[2] = {first | second << 16, 0xe4e4e4e4};
      const auto bytes = std::as_bytes(std::span(words));
      blocks.insert(blocks.end(), bytes.begin(), bytes.end());
    }
  const auto foreign = test::foreign_bytes(TextureFormat::kBc1Unorm, blocks);
  size_t wrong = 0;
  for (size_t b = 0; b < blocks.size() / 8; ++b) {
    BlockTexels t;
    decode_bc1(reinterpret_cast<const uint8_t*>(&blocks[8 * b]), t);
    for (size_t i = 0; i < 64; ++i)
      wrong += t.rgba[i / 4][i % 4] != static_cast<float>(foreign[64 * b + i]) / 255.0f;
  }
  EXPECT_EQ(wrong, 0u);
}

// A byte lies at most 1 from a third between two ends of 5 bits, and on one of 6: ends are 8.2 apart, so
// thirds of neighbours are 2.7 apart, and those of ends further away fall between.
TEST(Bc1, SolidColoursAreOneOffAtMost) {
  for (int v = 0; v < 256; ++v) {
    BlockTexels t;
    for (int i = 0; i < 16; ++i) {
      t.weight[i] = 1;
      for (int c = 0; c < 4; ++c) t.rgba[i][c] = static_cast<float>((v + c * 50) % 256) / 255.0f;
    }
    const BlockTexels out = round_trip(bc1(), t, {BlockEffort::kFast, BlockMetric::kLinear, false});
    for (int i = 0; i < 16; ++i)
      for (int c = 0; c < 3; ++c)
        EXPECT_LE(std::abs(out.rgba[i][c] - t.rgba[i][c]) * 255, 1.001f) << v << " " << c;
    EXPECT_EQ(out.rgba[0][3], 1.0f);
  }
}

TEST(Bc1, ColoursOfFourPlacesAreExact) {
  std::mt19937 random(3);
  for (int n = 0; n < 300; ++n) {
    uint8_t block[8];
    for (uint8_t& b : block) b = static_cast<uint8_t>(random());
    block[4] = 0xe4;  // all four colours occur
    if ((block[0] | block[1] << 8) <= (block[2] | block[3] << 8)) continue;
    BlockTexels t;
    decode_bc1(block, t);
    std::fill_n(t.weight, 16, 1.0f);
    const BlockTexels out = round_trip(bc1(), t, {BlockEffort::kBest, BlockMetric::kLinear, false});
    EXPECT_EQ(squared_error(t, out, 3), 0.0) << n;
  }
}

TEST(Bc1, EffortsNeverErrMoreAndPay) {
  std::mt19937 random(2);
  double sum[3] = {};
  for (const test::Sample sample : test::kSamples)
    for (int n = 0; n < 60; ++n) {
      BlockTexels t = sample_block(sample, random);
      for (float& w : t.weight) w = static_cast<float>(random() % 4) / 3;
      t.weight[5] = 1;
      double before = 1e30;
      for (int e = 0; e < 3; ++e) {
        const double error =
            squared_error(t, round_trip(bc1(), t, {kEfforts[e], BlockMetric::kLinear, false}), 3);
        EXPECT_LE(error, before * (1 + 64 * 0x1p-24)) << static_cast<int>(sample);  // see bc7_encode_test.cpp
        before = error;
        sum[e] += error;
      }
    }
  EXPECT_LT(sum[1], sum[0]);
  EXPECT_LT(sum[2], sum[1]);
}

TEST(Bc1, NeverTransparent) {
  std::mt19937 random(4);
  for (const test::Sample sample : test::kSamples)
    for (const BlockEffort effort : kEfforts)
      for (int n = 0; n < 40; ++n) {
        BlockTexels t = sample_block(sample, random);
        if (n % 2)  // nearly solid: ends that round to the same
          for (auto& texel : t.rgba)
            for (float& v : texel) v = 0.3f + 0.002f * v;
        const BlockTexels out = round_trip(bc1(), t, {effort, BlockMetric::kLinear, false});
        for (const auto& texel : out.rgba) EXPECT_EQ(texel[3], 1.0f);
      }
}

}  // namespace
}  // namespace kiln
