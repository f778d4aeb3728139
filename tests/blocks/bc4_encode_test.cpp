// The encoders of BC4 and BC5. Their error is that of our decoders (bc4_decode_test.cpp).
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "coordinator/output/blocks/bc4.h"
#include "coordinator/output/blocks/bc5.h"
#include "tests/blocks/bc4_samples.h"

namespace kiln {
namespace {

using test::channel_block;
using test::channel_truth;
using test::ChannelTruth;
using test::kChannelRounding;
using test::rms_of;
using test::round_trip;

constexpr BlockEffort kEfforts[] = {BlockEffort::kFast, BlockEffort::kNormal, BlockEffort::kBest};

const BlockFormat& bc4(bool is_signed) {
  return *find_block_format(is_signed ? "bc4_snorm" : "bc4");
}

BlockTexels filled(std::span<const float> values) {
  BlockTexels t{};
  for (size_t i = 0; i < 16; ++i) t.rgba[i][0] = values[i % values.size()], t.weight[i] = 1;
  return t;
}

// Ends one step apart reach every seventh of a step, or every fifth, and no ends reach anything else.
TEST(Bc4Encode, EqualTexelsTakeTheNearestValueThereIs) {
  std::mt19937 random(1);
  for (const bool is_signed : {false, true})
    for (int n = 0; n < 3000; ++n) {
      const double one = is_signed ? 127 : 255;
      float v = n < 256 ? static_cast<float>((n - (is_signed ? 128 : 0)) / one)
                        : static_cast<float>(random()) / 0x1p32f;
      if (is_signed) v = n < 256 ? std::max(v, -1.0f) : 2 * v - 1;
      double least = 1;
      for (const double parts : {5 * one, 7 * one})
        least = std::min(least, std::abs(std::round(v * parts) / parts - v));
      for (const BlockEffort effort : kEfforts) {
        const BlockTexels out = round_trip(bc4(is_signed), filled(std::span(&v, 1)), {effort, {}, false});
        // Roundings of at most 2^-25 each: the decoded value; with sign 127 v, which is 2^-18 of a step, and
        // the sum with 127, 2^-17 of one; sevenths of it twice as much.
        for (const auto& texel : out.rgba) EXPECT_LE(std::abs(texel[0] - v), least + 0x1p-22) << v;
      }
    }
}

TEST(Bc4Encode, TwoValuesAreExact) {
  for (const bool is_signed : {false, true})
    for (int a = is_signed ? -127 : 0; a <= (is_signed ? 127 : 255); a += 3)
      for (int b = a; b <= (is_signed ? 127 : 255); b += 7) {
        const float one = is_signed ? 127 : 255;
        const float values[3] = {static_cast<float>(a) / one, static_cast<float>(b) / one,
                                 static_cast<float>(a) / one};
        const BlockTexels t = filled(values);
        for (const BlockEffort effort : kEfforts) {
          const BlockTexels out = round_trip(bc4(is_signed), t, {effort, {}, false});
          for (int i = 0; i < 16; ++i) EXPECT_EQ(out.rgba[i][0], t.rgba[i][0]) << a << " " << b;
        }
      }
}

TEST(Bc4Encode, StairsAreExactAndSoAreThoseBesideBottomAndTop) {
  for (const bool is_signed : {false, true}) {
    const float one = is_signed ? 127 : 255;
    const auto bottom = static_cast<float>(is_signed ? -127 : 0);
    for (int step = 1; step < 17; ++step) {
      float stairs[8], beside[8] = {bottom / one, 1};
      for (int k = 0; k < 8; ++k) stairs[k] = (bottom + static_cast<float>(11 + step * k)) / one;
      for (int k = 0; k < 6; ++k) beside[k + 2] = (bottom + static_cast<float>(90 + step * k)) / one;
      for (const auto& values : {stairs, beside}) {
        const BlockTexels t = filled(std::span(values, 8));
        for (const BlockEffort effort : kEfforts) {
          const BlockTexels out = round_trip(bc4(is_signed), t, {effort, {}, false});
          for (int i = 0; i < 16; ++i)
            EXPECT_EQ(out.rgba[i][0], t.rgba[i][0]) << step << " " << static_cast<int>(effort);
        }
      }
    }
  }
}

TEST(Bc4Encode, BestIsTheBestThereIs) {
  std::mt19937 random(2);
  for (const test::Sample sample : test::kSamples)
    for (const bool is_signed : {false, true})
      for (const bool weighted : {false, true})
        for (int n = 0; n < 4; ++n) {
          const BlockTexels t = channel_block(sample, is_signed, weighted, random);
          const ChannelTruth c = channel_truth(t, 0, is_signed);
          const double rms = rms_of(c, round_trip(bc4(is_signed), t, {BlockEffort::kBest, {}, false}), 0);
          const double truth = test::least_rms(c);
          EXPECT_LE(rms, truth + kChannelRounding) << static_cast<int>(sample) << is_signed << weighted << n;
          EXPECT_GE(rms, truth - kChannelRounding);
        }
}

TEST(Bc4Encode, EffortsNeverErrMoreNorDoesAPlainEncoderErrLess) {
  std::mt19937 random(3);
  for (const bool is_signed : {false, true}) {
    double sum[3] = {}, plain_sum = 0;
    for (const test::Sample sample : test::kSamples)
      for (int n = 0; n < 60; ++n) {
        const BlockTexels t = channel_block(sample, is_signed, n % 2, random);
        const ChannelTruth c = channel_truth(t, 0, is_signed);
        double before = test::plain_rms(c);
        plain_sum += before * before;
        for (int e = 0; e < 3; ++e) {
          const double rms = rms_of(c, round_trip(bc4(is_signed), t, {kEfforts[e], {}, false}), 0);
          EXPECT_LE(rms, before + kChannelRounding) << static_cast<int>(sample) << " " << e;
          before = rms;
          sum[e] += rms * rms;
        }
      }
    EXPECT_LT(sum[0], plain_sum);
    EXPECT_LT(sum[1], sum[0]);
    EXPECT_LT(sum[2], sum[1]);
    const std::string sign = is_signed ? "signed_" : "unsigned_";  // shares for docs/encoding.md
    for (int e = 0; e < 3; ++e)
      RecordProperty(sign + "effort_" + std::to_string(e), std::to_string(sum[e] / plain_sum));
  }
}

TEST(Bc4Encode, TexelsWithoutWeightCostNothing) {
  std::mt19937 random(6);
  for (const BlockEffort effort : kEfforts)
    for (int n = 0; n < 50; ++n) {
      BlockTexels t = channel_block(test::Sample::kSmooth, false, false, random);
      for (int i = 0; i < 16; ++i)
        if (random() % 2 && i != 3 && i != 12) t.weight[i] = 0;
      BlockTexels other = t;
      for (int i = 0; i < 16; ++i)
        if (t.weight[i] == 0)
          for (float& v : other.rgba[i]) v = static_cast<float>(random() % 2);
      const BlockTexels a = round_trip(bc4(false), t, {effort, {}, false}),
                        b = round_trip(bc4(false), other, {effort, {}, false});
      for (int i = 0; i < 16; ++i)
        if (t.weight[i] > 0) EXPECT_EQ(a.rgba[i][0], b.rgba[i][0]);
    }
}

// Nine values cannot all be met. Ends of which one is at the heavy texel err by the block's range at most
// elsewhere, and the best ends err no more: that bounds what is off where the weight is.
TEST(Bc4Encode, WeightDecidesWhatIsMet) {
  for (int heavy = 0; heavy < 9; ++heavy) {
    float values[16];
    for (int i = 0; i < 16; ++i) values[i] = static_cast<float>(40 + 17 * (i % 9) + (i % 9 == 4)) / 255;
    BlockTexels t = filled(values);
    t.weight[heavy] = 1e6f;
    const BlockTexels out = round_trip(bc4(false), t, {BlockEffort::kBest, {}, false});
    EXPECT_LE(1e6 * std::pow(out.rgba[heavy][0] - t.rgba[heavy][0], 2), 15 * std::pow(137 / 255.0, 2))
        << heavy;
    EXPECT_GT(test::squared_error(t, out, 1), 0.0);
  }
}

TEST(Bc5Encode, IsABlockOfBc4ForEachChannel) {
  std::mt19937 random(7);
  for (const bool is_signed : {false, true})
    for (const BlockEffort effort : kEfforts)
      for (int n = 0; n < 60; ++n) {
        BlockTexels t = channel_block(test::kSamples[n % 6], is_signed, n % 4 == 0, random);
        uint8_t two[16], red[8], green[8];
        find_block_format(is_signed ? "bc5_snorm" : "bc5")->encode(t, {effort, {}, false}, two);
        bc4(is_signed).encode(t, {effort, {}, false}, red);
        for (auto& texel : t.rgba) texel[0] = texel[1];
        bc4(is_signed).encode(t, {effort, {}, false}, green);
        EXPECT_EQ(std::memcmp(two, red, 8), 0);
        EXPECT_EQ(std::memcmp(two + 8, green, 8), 0);
      }
}

TEST(Bc4Encode, NeverMinus128) {
  std::mt19937 random(8);
  for (const BlockEffort effort : kEfforts)
    for (int n = 0; n < 120; ++n) {
      BlockTexels t = channel_block(test::kSamples[n % 6], true, false, random);
      for (auto& texel : t.rgba) texel[0] = std::max(-1.0f, texel[0] - static_cast<float>(n % 3) * 0.7f);
      uint8_t block[8];
      encode_bc4_snorm(t, {effort, {}, false}, block);
      EXPECT_NE(block[0], 128);
      EXPECT_NE(block[1], 128);
    }
}

TEST(Bc4Encode, NotANumberIsRefusedByItsPlace) {
  for (const char* name : {"bc4", "bc4_snorm", "bc5", "bc5_snorm"}) {
    const BlockFormat& format = *find_block_format(name);
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
      std::vector<float> rgba(size_t{4} * 9 * 5, 0.5f), weight(size_t{9} * 5, 1.0f);
      rgba[4 * (9 * 4 + 7) + (format.channels - 1)] = bad;
      const auto refused = encode_blocks(format, {9, 5, rgba, weight}, {});
      ASSERT_FALSE(refused) << name;
      EXPECT_EQ(refused.error().message, "texel 7, 4 is not finite and cannot be compressed");
      EXPECT_EQ(refused.error().kind, ErrorKind::kInvalidInput);
      weight[9 * 4 + 7] = 0;  // nobody's texel may hold anything
      const auto blocks = encode_blocks(format, {9, 5, rgba, weight}, {});
      ASSERT_TRUE(blocks) << name;
      const auto out = decode_blocks(format, *blocks, 9, 5);
      ASSERT_TRUE(out);
      // Sevenths of a step are no further than a 14th of one, and a float at 0.5 is rounded by 2^-25.
      for (size_t i = 0; i < 45; ++i) EXPECT_NEAR((*out)[4 * i], 0.5f, 1.0 / 14 / 127 + 0x1p-25) << name;
    }
  }
}

}  // namespace
}  // namespace kiln
