// Texel formats of the files that engines load, by the names of Vulkan, with their numbers elsewhere.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace kiln {

enum class TextureFormat : uint8_t {
  kRgba8Unorm,
  kRgba16Float,
  kRgba32Float,
  kRgb9e5,  // E5B9G9R9_UFLOAT_PACK32
  kRg16Float,
  kBc1Unorm,
  kBc4Unorm,
  kBc4Snorm,
  kBc5Unorm,
  kBc5Snorm,
  kBc6hUfloat,
  kBc6hSfloat,
  kBc7Unorm,
  kAstc4x4Unorm,
  kAstc6x6Unorm,
  kAstc8x8Unorm,
  kAstc4x4Sfloat,
  kAstc6x6Sfloat,
  kAstc8x8Sfloat,
};
constexpr int kTextureFormats = 19;

struct TextureFormatInfo {
  TextureFormat format;
  std::string_view name;      // "BC6H_UFLOAT_BLOCK"
  std::string_view word;      // "bc6h": in names of files
  uint32_t vulkan;            // VkFormat
  uint32_t dxgi;              // DXGI_FORMAT; 0: there is none
  uint32_t block_x, block_y;  // texels; 1 of formats without blocks
  uint32_t bytes;             // of a block
};

const TextureFormatInfo& texture_format(TextureFormat format);
std::span<const TextureFormatInfo> texture_formats();  // all of them, in the order of the enumeration
// Bytes of one image: whole blocks, rows without padding.
uint64_t image_bytes(TextureFormat format, uint32_t width, uint32_t height);

}  // namespace kiln
