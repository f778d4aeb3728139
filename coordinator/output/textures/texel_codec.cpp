#include "coordinator/output/textures/texel_codec.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/base/format.h"
#include "coordinator/output/astc/astc.h"

namespace kiln {
namespace {

bool is_astc(TextureFormat f) {
  return f >= TextureFormat::kAstc4x4Unorm;
}

Status check_finite(const BlockImage& image) {
  for (size_t t = 0; t < size_t{image.width} * image.height; ++t)
    for (size_t c = 0; c < 4; ++c)
      if (!std::isfinite(image.rgba[4 * t + c]) && (image.weight.empty() || image.weight[t] > 0))
        return fail(ErrorKind::kInvalidInput, text("texel {}, {} is not finite and cannot be stored",
                                                   t % image.width, t / image.width));
  return {};
}

// A texel without weight may hold anything.
float clean(float v, const ValueRange& range) {
  return std::isfinite(v) ? std::clamp(v, range.lowest, range.highest) : 0.0f;
}

Bytes encode_plain(TextureFormat format, Unpack unpack, const BlockImage& image) {
  const size_t size = texture_format(format).bytes, count = size_t{image.width} * image.height;
  const ValueRange range = value_range(format, unpack);
  Bytes out(size * count);
  for (size_t t = 0; t < count; ++t) {
    float v[4];
    for (int c = 0; c < 4; ++c) v[c] = clean(image.rgba[4 * t + c], range);
    std::byte* at = &out[size * t];
    if (format == TextureFormat::kRgba16Float || format == TextureFormat::kRg16Float) {
      uint16_t h[4];
      for (int c = 0; c < 4; ++c) h[c] = to_half(v[c]);
      std::memcpy(at, h, size);
    } else if (format == TextureFormat::kRgba32Float) {
      std::memcpy(at, v, sizeof v);
    } else if (format == TextureFormat::kRgb9e5) {
      const uint32_t bits = to_rgb9e5(v);
      std::memcpy(at, &bits, sizeof bits);
    } else {
      uint8_t b[4];
      pack_texel(unpack, v, b);
      std::memcpy(at, b, sizeof b);
    }
  }
  return out;
}

}  // namespace

const BlockFormat* block_format(TextureFormat format) {
  switch (format) {
    case TextureFormat::kBc1Unorm:
      return find_block_format("bc1");
    case TextureFormat::kBc4Unorm:
      return find_block_format("bc4");
    case TextureFormat::kBc4Snorm:
      return find_block_format("bc4_snorm");
    case TextureFormat::kBc5Unorm:
      return find_block_format("bc5");
    case TextureFormat::kBc5Snorm:
      return find_block_format("bc5_snorm");
    case TextureFormat::kBc6hUfloat:
      return find_block_format("bc6h_ufloat");
    case TextureFormat::kBc6hSfloat:
      return find_block_format("bc6h_sfloat");
    case TextureFormat::kBc7Unorm:
      return find_block_format("bc7");
    default:
      return nullptr;
  }
}

ValueRange value_range(TextureFormat format, Unpack unpack) {
  if (unpack != Unpack::kNone) return {0, unpack_most(unpack)};
  if (const BlockFormat* block = block_format(format)) return {block->lowest, block->highest};
  switch (format) {
    case TextureFormat::kRgba32Float:
      return {-3e38f, 3e38f};
    case TextureFormat::kRgba16Float:
    case TextureFormat::kRg16Float:
      return {-65504, 65504};
    case TextureFormat::kRgb9e5:
      return {0, 65408};
    case TextureFormat::kAstc4x4Sfloat:
    case TextureFormat::kAstc6x6Sfloat:
    case TextureFormat::kAstc8x8Sfloat:
      return {0, 65504};
    default:
      return {0, 1};
  }
}

Expected<Bytes> encode_texels(TextureFormat format, Unpack unpack, const BlockImage& image,
                              const BlockChoice& choice) {
  if (const BlockFormat* block = block_format(format)) return encode_blocks(*block, image, choice);
  if (is_astc(format)) return encode_astc(format, image, choice);
  KILN_TRY_STATUS(check_finite(image));
  return encode_plain(format, unpack, image);
}

Expected<std::vector<float>> decode_texels(TextureFormat format, std::span<const std::byte> bytes,
                                           uint32_t width, uint32_t height) {
  if (const BlockFormat* block = block_format(format)) return decode_blocks(*block, bytes, width, height);
  if (bytes.size() < image_bytes(format, width, height))
    return fail(ErrorKind::kInvalidInput, text("{} bytes are too few for {}x{} texels of {}", bytes.size(),
                                               width, height, texture_format(format).name));
  if (is_astc(format)) return decode_astc(format, bytes, width, height);
  const size_t size = texture_format(format).bytes, count = size_t{width} * height;
  std::vector<float> out(4 * count);
  for (size_t t = 0; t < count; ++t) {
    const std::byte* at = &bytes[size * t];
    float* v = &out[4 * t];
    if (format == TextureFormat::kRgba16Float || format == TextureFormat::kRg16Float) {
      constexpr uint16_t kOne = 0x3c00;
      uint16_t h[4] = {0, 0, 0, kOne};
      std::memcpy(h, at, size);
      for (int c = 0; c < 4; ++c) v[c] = from_half(h[c]);
    } else if (format == TextureFormat::kRgba32Float) {
      std::memcpy(v, at, 16);
    } else if (format == TextureFormat::kRgb9e5) {
      uint32_t bits;
      std::memcpy(&bits, at, sizeof bits);
      from_rgb9e5(bits, v);
      v[3] = 1;
    } else {
      for (int c = 0; c < 4; ++c) v[c] = static_cast<float>(std::to_integer<uint8_t>(at[c])) / 255;
    }
  }
  return out;
}

}  // namespace kiln
