// ASTC through libastcenc: what goes in comes out within the format's error, for any size and any threads.
#include "coordinator/output/astc/astc.h"

#include <algorithm>
#include <limits>
#include <random>

namespace kiln {
namespace {

constexpr TextureFormat kUnorm[] = {TextureFormat::kAstc4x4Unorm, TextureFormat::kAstc6x6Unorm,
                                    TextureFormat::kAstc8x8Unorm};
constexpr TextureFormat kSfloat[] = {TextureFormat::kAstc4x4Sfloat, TextureFormat::kAstc6x6Sfloat,
                                     TextureFormat::kAstc8x8Sfloat};

struct Picture {
  uint32_t width, height;
  std::vector<float> rgba, weight;
  BlockImage image() const { return {width, height, rgba, weight}; }
};

// Waves of three lengths, 0 to `top`; some of it random.
Picture waves(uint32_t width, uint32_t height, float top, float noise) {
  std::mt19937 random(5);
  Picture p{width, height, std::vector<float>(4 * width * height), {}};
  for (uint32_t i = 0; i < width * height; ++i)
    for (uint32_t c = 0; c < 4; ++c) {
      const float wave = 0.5f + 0.4f * std::sin(0.07f * static_cast<float>((c + 1) * (i % width)) +
                                                0.05f * static_cast<float>(i / width));
      p.rgba[4 * i + c] = c == 3 ? wave : top * (wave + noise * static_cast<float>(random() % 1000) / 1000);
    }
  return p;
}

double mean_square(const std::vector<float>& a, const std::vector<float>& b, int channels) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i)
    if (static_cast<int>(i % 4) < channels) sum += (double{a[i]} - b[i]) * (double{a[i]} - b[i]);
  return sum / static_cast<double>(a.size()) * 4 / channels;
}

TEST(Astc, ConstantsComeBack) {
  for (const float v : {0.0f, 51.0f / 255, 1.0f})
    for (const TextureFormat format : kUnorm) {
      const Picture p{9, 7, std::vector<float>(4 * 63, v), {}};
      const auto blocks = encode_astc(format, p.image(), {BlockEffort::kFast, BlockMetric::kLinear, true});
      ASSERT_TRUE(blocks);
      const auto out = decode_astc(format, *blocks, 9, 7);
      ASSERT_TRUE(out);
      for (const float got : *out)
        EXPECT_NEAR(got, v, v * 0x1p-11f + 1.0f / 65535);  // 16 bits, which the library hands out as halfs
    }
  // A constant block of HDR holds halfs.
  for (const float v : {0.0f, 0.001f, 1.0f, 1000.0f, 65504.0f})
    for (const TextureFormat format : kSfloat) {
      const Picture p{9, 7, std::vector<float>(4 * 63, v), {}};
      const auto blocks = encode_astc(format, p.image(), {BlockEffort::kFast, BlockMetric::kLinear, false});
      ASSERT_TRUE(blocks);
      const auto out = decode_astc(format, *blocks, 9, 7);
      ASSERT_TRUE(out);
      for (size_t i = 0; i < out->size(); ++i)
        EXPECT_NEAR((*out)[i], i % 4 == 3 ? 1.0f : v, i % 4 == 3 ? 0.0f : v * 0x1p-10f) << v;
    }
}

// Smaller blocks and more effort never err more on the whole picture, and the smallest are good: the presets'
// own promise, which a wrong block size, profile or order of channels breaks.
TEST(Astc, BlocksAndEffortsKeepTheirOrder) {
  const Picture low = waves(96, 64, 1, 0.05f), high = waves(96, 64, 200, 0.05f);
  for (const bool hdr : {false, true}) {
    double sizes = 0;
    for (const TextureFormat format : hdr ? kSfloat : kUnorm) {
      double efforts = 1e30;
      const Picture& p = hdr ? high : low;
      for (const BlockEffort effort : {BlockEffort::kFast, BlockEffort::kNormal, BlockEffort::kBest}) {
        const auto blocks = encode_astc(format, p.image(), {effort, BlockMetric::kLinear, false});
        ASSERT_TRUE(blocks);
        const auto out = decode_astc(format, *blocks, p.width, p.height);
        std::vector<float> wanted = p.rgba;
        for (float& v : wanted) v = std::min(v, hdr ? 65504.0f : 1.0f);
        const double error = mean_square(*out, wanted, 3);
        EXPECT_LE(error, efforts * 1.02) << texture_format(format).name;
        efforts = error;
        for (size_t i = 3; i < out->size(); i += 4) EXPECT_EQ((*out)[i], 1.0f);
      }
      EXPECT_GT(efforts, sizes);
      sizes = efforts;
      EXPECT_LT(efforts, hdr ? 40.0 : 0.001) << texture_format(format).name;
    }
  }
}

TEST(Astc, AlphaIsKeptWhenItCounts) {
  const Picture p = waves(32, 32, 0.5f, 0);
  const auto blocks = encode_astc(TextureFormat::kAstc4x4Unorm, p.image(),
                                  {BlockEffort::kNormal, BlockMetric::kLinear, true});
  ASSERT_TRUE(blocks);
  EXPECT_LT(mean_square(*decode_astc(TextureFormat::kAstc4x4Unorm, *blocks, 32, 32), p.rgba, 4), 0.001);
}

TEST(Astc, SameBytesForAnyNumberOfThreads) {
  const Picture p = waves(75, 50, 3, 0.3f);
  for (const TextureFormat format : {TextureFormat::kAstc4x4Unorm, TextureFormat::kAstc6x6Sfloat})
    for (const BlockEffort effort : {BlockEffort::kFast, BlockEffort::kNormal}) {
      const auto one = encode_astc(format, p.image(), {effort, BlockMetric::kLog, false}, true, 1);
      ASSERT_TRUE(one);
      for (const unsigned threads : {2u, 3u, 1u}) {
        const auto other = encode_astc(format, p.image(), {effort, BlockMetric::kLog, false}, true, threads);
        ASSERT_TRUE(other);
        EXPECT_EQ(*one, *other) << threads;
      }
      EXPECT_EQ(*decode_astc(format, *one, 75, 50, 1), *decode_astc(format, *one, 75, 50, 2));
    }
}

TEST(Astc, AnySize) {
  for (const TextureFormatInfo& info : texture_formats()) {
    if (info.format < TextureFormat::kAstc4x4Unorm) continue;
    for (const auto& [width, height] : {std::pair{1u, 1u}, {3u, 5u}, {13u, 7u}}) {
      const Picture p{width, height, std::vector<float>(4 * width * height, 0.5f), {}};
      const auto blocks = encode_astc(info.format, p.image(), {});
      ASSERT_TRUE(blocks);
      EXPECT_EQ(blocks->size(), image_bytes(info.format, width, height));
      const auto out = decode_astc(info.format, *blocks, width, height);
      ASSERT_TRUE(out);
      ASSERT_EQ(out->size(), p.rgba.size());
      for (size_t i = 0; i < out->size(); ++i) EXPECT_NEAR((*out)[i], i % 4 == 3 ? 1.0f : 0.5f, 1.0f / 1024);
      EXPECT_FALSE(decode_astc(info.format, std::span(*blocks).first(blocks->size() - 1), width, height));
    }
  }
}

// Texels of nobody, far from the others: filled, they do not stretch the block; not finite, they are not met.
TEST(Astc, TexelsWithoutWeightCostNothing) {
  for (const TextureFormat format : {TextureFormat::kAstc8x8Unorm, TextureFormat::kAstc6x6Sfloat}) {
    Picture p = waves(48, 48, 0.2f, 0);
    p.weight.assign(48 * 48, 1.0f);
    for (size_t i = 0; i < 48 * 48; ++i)
      if (i % 5 < 2) {
        p.weight[i] = 0;
        for (size_t c = 0; c < 4; ++c)
          p.rgba[4 * i + c] = i % 2 ? std::numeric_limits<float>::infinity() : 1.0f;
      }
    double error[2];
    for (const bool fill : {false, true}) {
      const auto blocks =
          encode_astc(format, p.image(), {BlockEffort::kNormal, BlockMetric::kLinear, false}, fill);
      ASSERT_TRUE(blocks);
      const auto out = decode_astc(format, *blocks, 48, 48);
      error[fill] = 0;
      for (size_t i = 0; i < out->size(); ++i)
        if (p.weight[i / 4] > 0 && i % 4 < 3)
          error[fill] += ((*out)[i] - p.rgba[i]) * ((*out)[i] - p.rgba[i]);
    }
    EXPECT_LT(error[1], 0.2 * error[0]) << texture_format(format).name;
  }
  // A block of nobody is black.
  const Picture none{8, 8, std::vector<float>(256, 0.7f), std::vector<float>(64, 0.0f)};
  const auto blocks = encode_astc(TextureFormat::kAstc8x8Unorm, none.image(), {});
  ASSERT_TRUE(blocks);
  const auto out = decode_astc(TextureFormat::kAstc8x8Unorm, *blocks, 8, 8);
  for (size_t i = 0; i < 256; ++i) EXPECT_EQ((*out)[i], i % 4 == 3 ? 1.0f : 0.0f);
}

TEST(Astc, WhatIsNotFiniteIsNamedByItsPlace) {
  Picture p = waves(16, 8, 1, 0);
  p.rgba[4 * (16 * 3 + 5) + 1] = std::numeric_limits<float>::quiet_NaN();
  const auto result = encode_astc(TextureFormat::kAstc6x6Sfloat, p.image(), {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message, "texel 5, 3 is not finite and cannot be compressed");
  EXPECT_EQ(result.error().kind, ErrorKind::kInvalidInput);
}

}  // namespace
}  // namespace kiln
