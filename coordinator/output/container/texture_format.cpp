#include "coordinator/output/container/texture_format.h"

#include <algorithm>

#include "common/base/check.h"

namespace kiln {
namespace {

// Vulkan 1.3, "VkFormat"; DXGI_FORMAT as of Direct3D 12, which has no ASTC.
constexpr TextureFormatInfo kFormats[kTextureFormats] = {
    {TextureFormat::kRgba8Unorm, "R8G8B8A8_UNORM", "rgba8", 37, 28, 1, 1, 4},
    {TextureFormat::kRgba16Float, "R16G16B16A16_SFLOAT", "half", 97, 10, 1, 1, 8},
    {TextureFormat::kRgba32Float, "R32G32B32A32_SFLOAT", "float", 109, 2, 1, 1, 16},
    {TextureFormat::kRgb9e5, "E5B9G9R9_UFLOAT_PACK32", "rgb9e5", 123, 67, 1, 1, 4},
    {TextureFormat::kRg16Float, "R16G16_SFLOAT", "half-2", 83, 34, 1, 1, 4},
    {TextureFormat::kBc1Unorm, "BC1_RGB_UNORM_BLOCK", "bc1", 131, 71, 4, 4, 8},
    {TextureFormat::kBc4Unorm, "BC4_UNORM_BLOCK", "bc4", 139, 80, 4, 4, 8},
    {TextureFormat::kBc4Snorm, "BC4_SNORM_BLOCK", "bc4-signed", 140, 81, 4, 4, 8},
    {TextureFormat::kBc5Unorm, "BC5_UNORM_BLOCK", "bc5", 141, 83, 4, 4, 16},
    {TextureFormat::kBc5Snorm, "BC5_SNORM_BLOCK", "bc5-signed", 142, 84, 4, 4, 16},
    {TextureFormat::kBc6hUfloat, "BC6H_UFLOAT_BLOCK", "bc6h", 143, 95, 4, 4, 16},
    {TextureFormat::kBc6hSfloat, "BC6H_SFLOAT_BLOCK", "bc6h-signed", 144, 96, 4, 4, 16},
    {TextureFormat::kBc7Unorm, "BC7_UNORM_BLOCK", "bc7", 145, 98, 4, 4, 16},
    {TextureFormat::kAstc4x4Unorm, "ASTC_4x4_UNORM_BLOCK", "astc-4x4", 157, 0, 4, 4, 16},
    {TextureFormat::kAstc6x6Unorm, "ASTC_6x6_UNORM_BLOCK", "astc-6x6", 165, 0, 6, 6, 16},
    {TextureFormat::kAstc8x8Unorm, "ASTC_8x8_UNORM_BLOCK", "astc-8x8", 171, 0, 8, 8, 16},
    {TextureFormat::kAstc4x4Sfloat, "ASTC_4x4_SFLOAT_BLOCK", "astc-4x4-hdr", 1000066000, 0, 4, 4, 16},
    {TextureFormat::kAstc6x6Sfloat, "ASTC_6x6_SFLOAT_BLOCK", "astc-6x6-hdr", 1000066004, 0, 6, 6, 16},
    {TextureFormat::kAstc8x8Sfloat, "ASTC_8x8_SFLOAT_BLOCK", "astc-8x8-hdr", 1000066007, 0, 8, 8, 16},
};

}  // namespace

const TextureFormatInfo& texture_format(TextureFormat format) {
  const auto i = static_cast<size_t>(format);
  KILN_CHECK(i < kTextureFormats && kFormats[i].format == format);
  return kFormats[i];
}

std::span<const TextureFormatInfo> texture_formats() {
  return kFormats;
}

uint64_t image_bytes(TextureFormat format, uint32_t width, uint32_t height) {
  const TextureFormatInfo& info = texture_format(format);
  const uint64_t across = (uint64_t{width} + info.block_x - 1) / info.block_x;
  const uint64_t down = (uint64_t{height} + info.block_y - 1) / info.block_y;
  return across * down * info.bytes;
}

}  // namespace kiln
