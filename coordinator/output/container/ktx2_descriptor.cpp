#include "coordinator/output/container/ktx2_descriptor.h"

#include <bit>

namespace kiln {
namespace {

enum : uint32_t {
  kModelRgbsda = 1,
  kModelBc1 = 128,
  kModelBc4 = 131,
  kModelBc5 = 132,
  kModelBc6h = 133,
  kModelBc7 = 134,
  kModelAstc = 162,
  kBt709 = 1,
  kLinear = 1,
  kAlpha = 15,
  kExponent = 0x20,
  kSigned = 0x40,
  kFloat = 0x80,
};

struct Sample {
  uint32_t first_bit, bits, channel;  // with qualifiers
  uint32_t lower, upper;
};

uint32_t bits(float value) {
  return std::bit_cast<uint32_t>(value);
}

uint32_t colour_model(TextureFormat format) {
  switch (format) {
    case TextureFormat::kRgba8Unorm:
    case TextureFormat::kRgba16Float:
    case TextureFormat::kRgba32Float:
    case TextureFormat::kRgb9e5:
    case TextureFormat::kRg16Float:
      return kModelRgbsda;
    case TextureFormat::kBc1Unorm:
      return kModelBc1;
    case TextureFormat::kBc4Unorm:
    case TextureFormat::kBc4Snorm:
      return kModelBc4;
    case TextureFormat::kBc5Unorm:
    case TextureFormat::kBc5Snorm:
      return kModelBc5;
    case TextureFormat::kBc6hUfloat:
    case TextureFormat::kBc6hSfloat:
      return kModelBc6h;
    case TextureFormat::kBc7Unorm:
      return kModelBc7;
    default:
      return kModelAstc;
  }
}

std::vector<Sample> samples(TextureFormat format) {
  std::vector<Sample> list;
  const auto rgba = [&](uint32_t size, uint32_t qualifiers, uint32_t lower, uint32_t upper) {
    for (uint32_t c = 0; c < 4; ++c)
      list.push_back({size * c, size, (c < 3 ? c : kAlpha) | qualifiers, lower, upper});
  };
  const uint32_t block_bits = 8 * texture_format(format).bytes;
  // Limits of blocks are those of 32-bit integers, which stand for 1 and -1.
  const auto channels = [&](uint32_t count, bool is_signed) {
    for (uint32_t c = 0; c < count; ++c)
      list.push_back({64 * c, 64, c | (is_signed ? kSigned : 0u), is_signed ? 0x80000000 : 0,
                      is_signed ? 0x7fffffff : 0xffffffff});
  };
  switch (format) {
    case TextureFormat::kRgba8Unorm:
      rgba(8, 0, 0, 255);
      break;
    case TextureFormat::kRgba16Float:
      rgba(16, kFloat | kSigned, bits(-1), bits(1));
      break;
    case TextureFormat::kRgba32Float:
      rgba(32, kFloat | kSigned, bits(-1), bits(1));
      break;
    case TextureFormat::kRgb9e5:
      // Mantissa and exponent of each channel. The mantissa 8448 / 2^9 at exponent 15 + 9 is the largest that
      // stands for 1; exponents have a bias of 15 (section 10.5).
      for (uint32_t c = 0; c < 3; ++c) {
        list.push_back({9 * c, 9, c, 0, 8448});
        list.push_back({27, 5, c | kExponent, 15, 31});
      }
      break;
    case TextureFormat::kRg16Float:
      for (uint32_t c = 0; c < 2; ++c) list.push_back({16 * c, 16, c | kFloat | kSigned, bits(-1), bits(1)});
      break;
    case TextureFormat::kBc4Unorm:
    case TextureFormat::kBc4Snorm:
      channels(1, format == TextureFormat::kBc4Snorm);
      break;
    case TextureFormat::kBc5Unorm:
    case TextureFormat::kBc5Snorm:
      channels(2, format == TextureFormat::kBc5Snorm);
      break;
    case TextureFormat::kBc6hUfloat:
      list.push_back({0, block_bits, kFloat, bits(0), bits(1)});
      break;
    case TextureFormat::kBc6hSfloat:
    case TextureFormat::kAstc4x4Sfloat:
    case TextureFormat::kAstc6x6Sfloat:
    case TextureFormat::kAstc8x8Sfloat:
      list.push_back({0, block_bits, kFloat | kSigned, bits(-1), bits(1)});
      break;
    default:
      list.push_back({0, block_bits, 0, 0, 0xffffffff});
  }
  return list;
}

}  // namespace

std::vector<uint32_t> ktx2_descriptor(TextureFormat format) {
  const TextureFormatInfo& info = texture_format(format);
  const std::vector<Sample> list = samples(format);
  const auto block = static_cast<uint32_t>(24 + 16 * list.size());
  std::vector<uint32_t> words = {
      4 + block,
      0,                // vendor Khronos, basic descriptor
      2 | block << 16,  // version 1.3 and later
      colour_model(format) | kBt709 << 8 | kLinear << 16,
      (info.block_x - 1) | (info.block_y - 1) << 8,
      info.bytes,  // plane 0; there is no other
      0,
  };
  for (const Sample& s : list)
    words.insert(words.end(), {s.first_bit | (s.bits - 1) << 16 | s.channel << 24, 0, s.lower, s.upper});
  return words;
}

uint32_t ktx2_type_size(TextureFormat format) {
  switch (format) {
    case TextureFormat::kRgba16Float:
    case TextureFormat::kRg16Float:
      return 2;
    case TextureFormat::kRgba32Float:
    case TextureFormat::kRgb9e5:
      return 4;
    default:
      return 1;
  }
}

}  // namespace kiln
