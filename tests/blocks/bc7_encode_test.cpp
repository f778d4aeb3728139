// The encoder of BC7. Its error is that of our decoder, which is that of OpenImageIO (bc7_decode_test.cpp).
#include <algorithm>
#include <cstring>

#include "coordinator/output/blocks/bc7.h"
#include "tests/blocks/samples.h"

namespace kiln {
namespace {

using test::round_trip;
using test::sample_block;
using test::squared_error;

constexpr BlockEffort kEfforts[] = {BlockEffort::kFast, BlockEffort::kNormal, BlockEffort::kBest};

const BlockFormat& bc7() {
  return *find_block_format("bc7");
}

TEST(Bc7Encode, SolidColoursAreExactInBytes) {
  // Every byte in every channel, beside others.
  for (int v = 0; v < 256; ++v) {
    BlockTexels t;
    for (int i = 0; i < 16; ++i) {
      t.weight[i] = 1;
      const int rgba[4] = {v, 255 - v, v * 7 % 256, v * 13 % 256};
      for (int c = 0; c < 4; ++c) t.rgba[i][c] = static_cast<float>(rgba[c]) / 255.0f;
    }
    const BlockTexels out = round_trip(bc7(), t, {BlockEffort::kFast, BlockMetric::kLinear, true});
    for (int i = 0; i < 16; ++i)
      for (int c = 0; c < 4; ++c) EXPECT_EQ(out.rgba[i][c], t.rgba[i][c]) << v;
  }
}

TEST(Bc7Encode, OpaqueBlocksDecodeWithAlphaOne) {
  std::mt19937 random(1);
  for (const test::Sample sample : test::kSamples)
    for (const BlockEffort effort : kEfforts)
      for (int n = 0; n < 20; ++n) {
        const BlockTexels out =
            round_trip(bc7(), sample_block(sample, random), {effort, BlockMetric::kLinear, false});
        for (const auto& texel : out.rgba) EXPECT_EQ(texel[3], 1.0f);
      }
}

TEST(Bc7Encode, EffortsNeverErrMore) {
  std::mt19937 random(2);
  for (const test::Sample sample : test::kSamples)
    for (const bool alpha : {false, true})
      for (int n = 0; n < 40; ++n) {
        BlockTexels t = sample_block(sample, random);
        for (float& w : t.weight) w = static_cast<float>(random() % 4) / 3;
        t.weight[5] = 1;
        double before = 1e30;
        for (const BlockEffort effort : kEfforts) {
          const double error =
              squared_error(t, round_trip(bc7(), t, {effort, BlockMetric::kLinear, alpha}), 3 + alpha);
          // The encoder compares sums of floats: 64 terms, each step rounded by 2^-24.
          EXPECT_LE(error, before * (1 + 64 * 0x1p-24)) << static_cast<int>(sample);
          before = error;
        }
      }
}

// Two colours whose bytes are ends of mode 6 (odd for opaque blocks) come back as they are; others within the
// rounding of ends to 7 bits, which is 1.
TEST(Bc7Encode, TwoColoursAreExactOrOneOff) {
  std::mt19937 random(3);
  for (int n = 0; n < 300; ++n) {
    int colour[2][3];
    for (auto& c : colour)
      for (int& v : c) v = static_cast<int>(random() % 256) | (n % 2);
    BlockTexels t;
    for (int i = 0; i < 16; ++i) {
      t.weight[i] = 1, t.rgba[i][3] = 1;
      const auto& from = colour[i < 2 ? i : static_cast<int>(random() % 2)];
      for (int c = 0; c < 3; ++c) t.rgba[i][c] = static_cast<float>(from[c]) / 255.0f;
    }
    const BlockTexels out = round_trip(bc7(), t, {BlockEffort::kFast, BlockMetric::kLinear, false});
    for (int i = 0; i < 16; ++i)
      for (int c = 0; c < 3; ++c)
        EXPECT_LE(std::abs(out.rgba[i][c] - t.rgba[i][c]) * 255, n % 2 ? 0.0f : 1.001f);
  }
}

// A gradient along one line: 16 places on it. A texel is at most half a step off, and the ends are off by at
// most 1 (opaque: odd bytes), the interpolation by 1/2; with weights of 64ths the widest step is 5/64.
TEST(Bc7Encode, GradientsStayWithinHalfAStep) {
  std::mt19937 random(4);
  for (int n = 0; n < 200; ++n) {
    const BlockTexels t = sample_block(test::Sample::kGradient, random);
    const BlockTexels out = round_trip(bc7(), t, {BlockEffort::kFast, BlockMetric::kLinear, false});
    double extent = 0;
    for (int c = 0; c < 3; ++c) {
      float low = 1, high = 0;
      for (const auto& texel : t.rgba) low = std::min(low, texel[c]), high = std::max(high, texel[c]);
      extent += 255.0 * 255 * (high - low) * (high - low);
    }
    const double bound = 16 * (extent * 2.5 * 2.5 / 64 / 64 + 3 * 1.5 * 1.5);
    EXPECT_LE(squared_error(t, out, 3), bound);
  }
}

// What a mode is for must pay: two gradients want two subsets, a channel of its own wants modes 4 or 5, noise
// wants anything. Somewhat less than the gains that were measured, so that a mode which is lost shows.
TEST(Bc7Encode, ModesPayWhereTheyShould) {
  std::mt19937 random(5);
  for (const auto& [sample, normal_gain, best_gain] : {std::tuple{test::Sample::kTwoGradients, 50.0, 55.0},
                                                       {test::Sample::kChannels, 4.0, 7.5},
                                                       {test::Sample::kNoise, 1.5, 2.0}}) {
    double sum[3] = {};
    for (int n = 0; n < 60; ++n) {
      const BlockTexels t = sample_block(sample, random);
      for (int e = 0; e < 3; ++e)
        sum[e] += squared_error(t, round_trip(bc7(), t, {kEfforts[e], BlockMetric::kLinear, false}), 3);
    }
    EXPECT_GT(sum[0] / sum[1], normal_gain) << static_cast<int>(sample);
    EXPECT_GT(sum[0] / sum[2], best_gain) << static_cast<int>(sample);
  }
}

TEST(Bc7Encode, TexelsWithoutWeightCostNothing) {
  std::mt19937 random(6);
  for (const bool alpha : {false, true}) {
    for (int n = 0; n < 50; ++n) {
      BlockTexels t = sample_block(test::Sample::kSmooth, random);
      for (int i = 0; i < 16; ++i)
        if (random() % 2 && i != 3 && i != 12) t.weight[i] = 0;
      BlockTexels other = t;
      for (int i = 0; i < 16; ++i)
        if (t.weight[i] == 0)
          for (float& v : other.rgba[i]) v = static_cast<float>(random() % 2);
      uint8_t a[16], b[16];
      BlockTexels da, db;
      encode_bc7(t, {BlockEffort::kNormal, BlockMetric::kLinear, alpha}, a);
      encode_bc7(other, {BlockEffort::kNormal, BlockMetric::kLinear, alpha}, b);
      decode_bc7(a, da);
      decode_bc7(b, db);
      // Their values may show in indices of their own alone.
      for (int i = 0; i < 16; ++i)
        if (t.weight[i] > 0) EXPECT_EQ(std::memcmp(da.rgba[i], db.rgba[i], 16), 0);
    }
  }
}

TEST(Bc7Encode, PerceptualMetricFavoursGreen) {
  std::mt19937 random(8);
  double error[2][3] = {};  // by metric, channel
  for (int n = 0; n < 100; ++n) {
    const BlockTexels t = sample_block(test::Sample::kNoise, random);
    for (const int perceptual : {0, 1}) {
      const BlockTexels out = round_trip(
          bc7(), t, {BlockEffort::kNormal, perceptual ? BlockMetric::kPerceptual : BlockMetric::kLog, false});
      for (int i = 0; i < 16; ++i)
        for (int c = 0; c < 3; ++c) {
          const double d = t.rgba[i][c] - out.rgba[i][c];
          error[perceptual][c] += d * d;
        }
    }
  }
  const auto luminance = [](const double(&e)[3]) { return 0.2126 * e[0] + 0.7152 * e[1] + 0.0722 * e[2]; };
  EXPECT_LT(luminance(error[1]), 0.7 * luminance(error[0]));
  EXPECT_LT(error[1][1], 0.7 * error[0][1]);
}

TEST(Bc7Encode, EmptyBlocksAndAnySize) {
  for (const auto& [width, height] : {std::pair{1u, 1u}, {3u, 5u}, {9u, 4u}}) {
    std::vector<float> rgba(4 * width * height, 0.25f), weight(width * height, 0.0f);
    const BlockImage image{width, height, rgba, weight};
    const auto empty = encode_blocks(bc7(), image, {});
    ASSERT_TRUE(empty);
    const auto out = decode_blocks(bc7(), *empty, width, height);
    ASSERT_TRUE(out);
    for (size_t i = 0; i < out->size(); ++i) EXPECT_EQ((*out)[i], i % 4 == 3 ? 1.0f : 0.0f);
    weight.assign(weight.size(), 1.0f);
    const auto full = encode_blocks(bc7(), {width, height, rgba, weight}, {});
    ASSERT_TRUE(full);
    const auto back = decode_blocks(bc7(), *full, width, height);
    for (size_t i = 0; i < back->size(); ++i) EXPECT_EQ((*back)[i], i % 4 == 3 ? 1.0f : 64.0f / 255);
  }
}

TEST(Bc7Encode, SameBytesForAnyNumberOfThreads) {
  std::mt19937 random(10);
  std::vector<float> rgba(4 * 61 * 43);
  for (float& v : rgba) v = static_cast<float>(random() % 1000) / 999;
  for (const char* name : {"bc1", "bc7"}) {
    const BlockFormat& format = *find_block_format(name);
    const auto one = encode_blocks(format, {61, 43, rgba, {}}, {}, true, 1);
    const auto three = encode_blocks(format, {61, 43, rgba, {}}, {}, true, 3);
    ASSERT_TRUE(one && three);
    EXPECT_EQ(*one, *three);
  }
}

}  // namespace
}  // namespace kiln
