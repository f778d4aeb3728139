// Every texture format, in and out of an image of its own values.
#include "coordinator/output/textures/texel_codec.h"

#include <limits>

namespace kiln {
namespace {

constexpr uint32_t kWidth = 29, kHeight = 10;  // no whole blocks; none crosses column 24

// How many channels a lookup gives; others are 0, alpha 1.
size_t channels_of(TextureFormat format) {
  if (const BlockFormat* block = block_format(format)) return block->channels;
  if (format == TextureFormat::kRg16Float) return 2;
  // RGBA8 keeps its alpha for packings, of which kNone has no use.
  const bool colour_alone = format == TextureFormat::kRgba8Unorm || format == TextureFormat::kRgb9e5 ||
                            format >= TextureFormat::kAstc4x4Sfloat;
  return colour_alone ? 3 : 4;
}

bool is_signed(TextureFormat format) {
  return value_range(format, Unpack::kNone).lowest < 0;
}

// Two colours side by side, of eight values 0.1 apart or more.
std::vector<float> two_colours(TextureFormat format) {
  std::vector<float> rgba;
  for (uint32_t t = 0; t < kWidth * kHeight; ++t)
    for (uint32_t c = 0; c < 4; ++c) {
      const float v = 0.1f * static_cast<float>(1 + c + (t % kWidth < 24 ? 0 : 4));
      rgba.push_back(is_signed(format) ? 2 * v - 1 : v);
    }
  return rgba;
}

TEST(TexelCodec, RangesAreThoseOfTheFormats) {
  for (const TextureFormatInfo& info : texture_formats()) {
    const ValueRange range = value_range(info.format, Unpack::kNone);
    const bool unorm = info.name.find("UNORM") != std::string_view::npos;
    const bool snorm = info.name.find("SNORM") != std::string_view::npos;
    if (unorm || snorm) {
      EXPECT_EQ(range.highest, 1.0f) << info.name;
      EXPECT_EQ(range.lowest, snorm ? -1.0f : 0.0f) << info.name;
    } else {
      EXPECT_GT(range.highest, 65000.0f) << info.name;
    }
  }
}

// What comes back is nearer to what was given than to any other value of the image.
TEST(TexelCodec, EveryFormatGivesBackItsChannelsInTheirPlaces) {
  for (const TextureFormatInfo& info : texture_formats()) {
    const std::vector<float> rgba = two_colours(info.format);
    BlockChoice choice;
    choice.alpha = channels_of(info.format) == 4;
    const auto bytes = encode_texels(info.format, Unpack::kNone, {kWidth, kHeight, rgba, {}}, choice);
    ASSERT_TRUE(bytes) << info.name;
    EXPECT_EQ(bytes->size(), image_bytes(info.format, kWidth, kHeight)) << info.name;
    const auto out = decode_texels(info.format, *bytes, kWidth, kHeight);
    ASSERT_TRUE(out) << info.name;
    ASSERT_EQ(out->size(), rgba.size()) << info.name;
    for (size_t i = 0; i < rgba.size(); ++i) {
      const bool held = i % 4 < channels_of(info.format);
      EXPECT_NEAR((*out)[i],
                  held         ? rgba[i]
                  : i % 4 == 3 ? 1.0f
                               : 0.0f,
                  held ? 0.05f : 0.0f)
          << info.name << " " << i;
    }
  }
}

TEST(TexelCodec, NotANumberIsRefusedAndTooFewBytesAre) {
  for (const TextureFormatInfo& info : texture_formats()) {
    std::vector<float> rgba = two_colours(info.format);
    rgba[4 * (kWidth * 3 + 2)] = std::numeric_limits<float>::quiet_NaN();
    const auto refused = encode_texels(info.format, Unpack::kNone, {kWidth, kHeight, rgba, {}}, {});
    ASSERT_FALSE(refused) << info.name;
    EXPECT_EQ(refused.error().kind, ErrorKind::kInvalidInput);
    EXPECT_NE(refused.error().message.find("texel 2, 3 "), std::string::npos) << refused.error().message;
    const Bytes few(image_bytes(info.format, kWidth, kHeight) - 1);
    const auto cut = decode_texels(info.format, few, kWidth, kHeight);
    ASSERT_FALSE(cut) << info.name;
    EXPECT_EQ(cut.error().kind, ErrorKind::kInvalidInput);
  }
}

}  // namespace
}  // namespace kiln
