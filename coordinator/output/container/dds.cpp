// DDS: "Programming Guide for DDS" and "DDS_HEADER_DXT10" of Direct3D's documentation. Images are stored by
// layer, each from the largest level to the smallest.
#include <algorithm>
#include <array>
#include <optional>

#include "common/base/format.h"
#include "coordinator/output/container/checks.h"

namespace kiln {
namespace {

constexpr uint32_t four(const char (&c)[5]) {
  return static_cast<uint32_t>(c[0]) | static_cast<uint32_t>(c[1]) << 8 | static_cast<uint32_t>(c[2]) << 16 |
         static_cast<uint32_t>(c[3]) << 24;
}

constexpr uint32_t kMagic = four("DDS "), kDx10 = four("DX10"), kDxt1 = four("DXT1");
constexpr uint32_t kHeaderBytes = 124, kPixelFormatBytes = 32, kDx10Bytes = 20;
constexpr uint32_t kTexture2d = 3, kTextureCube = 4;
// DDS_HEADER.dwFlags, DDS_PIXELFORMAT.dwFlags, dwCaps, dwCaps2
enum : uint32_t {
  kHasCaps = 0x1,
  kHasHeight = 0x2,
  kHasWidth = 0x4,
  kHasPitch = 0x8,
  kHasPixelFormat = 0x1000,
  kHasLevels = 0x20000,
  kHasLinearSize = 0x80000,
  kFormatAlpha = 0x1,
  kFormatFourCc = 0x4,
  kFormatRgb = 0x40,
  kCapsComplex = 0x8,
  kCapsTexture = 0x1000,
  kCapsLevels = 0x400000,
  kCaps2Cube = 0x200,
  kCaps2Volume = 0x200000,
};

std::optional<TextureFormat> format_of_dxgi(uint32_t dxgi) {
  for (const TextureFormatInfo& info : texture_formats())
    if (info.dxgi == dxgi && dxgi != 0) return info.format;
  return std::nullopt;
}

struct PixelFormat {
  uint32_t flags, four_cc, bits;
  std::array<uint32_t, 4> masks;
};
constexpr std::array<uint32_t, 4> kRgba8 = {0xff, 0xff00, 0xff0000, 0xff000000};

// Files without the DX10 header name the older formats in one of two ways.
std::optional<TextureFormat> format_of_dx9(const PixelFormat& p) {
  if (p.flags & kFormatFourCc) {
    if (p.four_cc == kDxt1) return TextureFormat::kBc1Unorm;
    if (p.four_cc == four("ATI1") || p.four_cc == four("BC4U")) return TextureFormat::kBc4Unorm;
    if (p.four_cc == four("BC4S")) return TextureFormat::kBc4Snorm;
    if (p.four_cc == four("ATI2") || p.four_cc == four("BC5U")) return TextureFormat::kBc5Unorm;
    if (p.four_cc == four("BC5S")) return TextureFormat::kBc5Snorm;
    if (p.four_cc == 113) return TextureFormat::kRgba16Float;  // D3DFMT_A16B16G16R16F
    if (p.four_cc == 116) return TextureFormat::kRgba32Float;  // D3DFMT_A32B32G32R32F
    return std::nullopt;
  }
  if (p.flags & kFormatRgb && p.flags & kFormatAlpha && p.bits == 32 && p.masks == kRgba8)
    return TextureFormat::kRgba8Unorm;
  return std::nullopt;
}

struct Head {
  TextureFormat format;
  uint32_t width, height, layers, levels;
};

Expected<Head> read_head(ByteReader& in) {
  const auto skip = [&](int words) {
    while (words--) in.get<uint32_t>();
  };
  if (in.get<uint32_t>() != kMagic)
    return bad_texture("this is not a DDS file: it does not begin with \"DDS \"");
  if (in.get<uint32_t>() != kHeaderBytes) return bad_texture("the DDS header does not state its size of 124");
  Head head{};
  const uint32_t flags = in.get<uint32_t>();
  head.height = in.get<uint32_t>();
  head.width = in.get<uint32_t>();
  skip(2);  // pitch, depth: the former is often wrong, as Direct3D's own documentation says
  const uint32_t levels = in.get<uint32_t>();
  head.levels = flags & kHasLevels ? std::max(1u, levels) : 1;
  skip(11);
  if (in.get<uint32_t>() != kPixelFormatBytes)
    return bad_texture("the DDS pixel format does not state its size of 32");
  PixelFormat p{};
  p.flags = in.get<uint32_t>();
  p.four_cc = in.get<uint32_t>();
  p.bits = in.get<uint32_t>();
  for (uint32_t& mask : p.masks) mask = in.get<uint32_t>();
  skip(1);
  const uint32_t caps2 = in.get<uint32_t>();
  skip(3);
  head.layers = 1;
  bool flat = !(caps2 & (kCaps2Cube | kCaps2Volume));
  std::optional<TextureFormat> format;
  if (p.flags & kFormatFourCc && p.four_cc == kDx10) {
    const uint32_t dxgi = in.get<uint32_t>();
    format = format_of_dxgi(dxgi);
    flat = flat && in.get<uint32_t>() == kTexture2d && !(in.get<uint32_t>() & kTextureCube);
    head.layers = in.get<uint32_t>();
    skip(1);
    if (in.ok() && !format) return bad_texture(text("DXGI format {} of the DDS file is not supported", dxgi));
  } else {
    format = format_of_dx9(p);
  }
  if (!in.ok()) return bad_texture("the DDS file ends within its header");
  if (!format) return bad_texture("the pixel format of the DDS file is not supported");
  if (!flat) return bad_texture("the DDS file is a cube or a volume, only flat textures are supported");
  head.format = *format;
  return head;
}

// Many readers know BC1 and RGBA8 only by their older names, which allow no layers.
PixelFormat pixel_format(const TextureImages& texture) {
  if (texture.layers() == 1 && texture.format == TextureFormat::kBc1Unorm)
    return {kFormatFourCc, kDxt1, 0, {}};
  if (texture.layers() == 1 && texture.format == TextureFormat::kRgba8Unorm)
    return {kFormatRgb | kFormatAlpha, 0, 32, kRgba8};
  return {kFormatFourCc, kDx10, 0, {}};
}

}  // namespace

Expected<Bytes> write_dds(const TextureImages& texture) {
  KILN_TRY_STATUS(check_images(texture));
  if (texture.is_volume) return bad_texture("DDS files of this program hold no volumes: use KTX2");
  const TextureFormatInfo& format = texture_format(texture.format);
  if (format.dxgi == 0) return bad_texture(text("DDS does not know {}: write it as KTX2", format.name));
  const auto levels = static_cast<uint32_t>(texture.levels.size());
  const bool blocks = format.block_x > 1;
  const auto first =
      static_cast<uint32_t>(image_bytes(texture.format, texture.width, blocks ? texture.height : 1));
  ByteWriter out;
  const auto words = [&](std::initializer_list<uint32_t> list) {
    for (const uint32_t word : list) out.put(word);
  };
  words({kMagic, kHeaderBytes,
         kHasCaps | kHasHeight | kHasWidth | kHasPixelFormat | (blocks ? kHasLinearSize : kHasPitch) |
             (levels > 1 ? kHasLevels : 0u),
         texture.height, texture.width, first, 0, levels > 1 ? levels : 0u});
  for (int i = 0; i < 11; ++i) out.put(uint32_t{0});
  const PixelFormat p = pixel_format(texture);
  words({kPixelFormatBytes, p.flags, p.four_cc, p.bits, p.masks[0], p.masks[1], p.masks[2], p.masks[3]});
  words({kCapsTexture | (levels > 1             ? kCapsComplex | kCapsLevels
                         : texture.layers() > 1 ? kCapsComplex
                                                : 0u),
         0, 0, 0, 0});
  if (p.four_cc == kDx10) words({format.dxgi, kTexture2d, 0, texture.layers(), 0});
  Bytes file = out.take();
  file.reserve(file.size() +
               texture_bytes(texture.format, texture.width, texture.height, texture.layers(), levels));
  for (uint32_t layer = 0; layer < texture.layers(); ++layer)
    for (const auto& level : texture.levels)
      file.insert(file.end(), level[layer].begin(), level[layer].end());
  return file;
}

Expected<TextureImages> read_dds(std::span<const std::byte> file, uint64_t max_bytes) {
  ByteReader in(file);
  KILN_TRY(const Head head, read_head(in));
  KILN_TRY_STATUS(check_sizes(head.width, head.height, head.layers, head.levels));
  const uint64_t bytes = texture_bytes(head.format, head.width, head.height, head.layers, head.levels);
  const bool dx10 = file.size() >= 88 && std::memcmp(&file[84], "DX10", 4) == 0;
  size_t at = 4 + kHeaderBytes + (dx10 ? kDx10Bytes : 0);
  if (bytes > max_bytes)
    return bad_texture(text("the DDS file has {} bytes of texels, the limit is {}", bytes, max_bytes));
  if (bytes > file.size() - at)
    return bad_texture(
        text("the DDS file has {} bytes of texels, its header asks for {}", file.size() - at, bytes));
  TextureImages texture{head.format, head.width, head.height, {}};
  texture.levels.assign(head.levels, std::vector<Bytes>(head.layers));
  for (uint32_t layer = 0; layer < head.layers; ++layer)
    for (uint32_t level = 0; level < head.levels; ++level) {
      const uint64_t size =
          image_bytes(head.format, level_side(head.width, level), level_side(head.height, level));
      const auto image = file.subspan(at, size);
      texture.levels[level][layer].assign(image.begin(), image.end());
      at += size;
    }
  return texture;
}

}  // namespace kiln
