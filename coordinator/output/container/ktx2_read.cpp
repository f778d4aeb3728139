#include <algorithm>
#include <optional>

#include "common/base/format.h"
#include "common/zstd/compress.h"
#include "coordinator/output/container/checks.h"
#include "coordinator/output/container/ktx2_file.h"

namespace kiln {
namespace {

constexpr uint32_t kBc1Rgba = 133;  // Vulkan's BC1_RGBA_UNORM_BLOCK: the same blocks
constexpr uint32_t kTransferUnspecified = 0, kTransferLinear = 1;

std::optional<TextureFormat> format_of_vulkan(uint32_t vulkan) {
  if (vulkan == kBc1Rgba) return TextureFormat::kBc1Unorm;
  for (const TextureFormatInfo& info : texture_formats())
    if (info.vulkan == vulkan) return info.format;
  return std::nullopt;
}

bool within(std::span<const std::byte> file, uint64_t offset, uint64_t bytes) {
  return offset <= file.size() && bytes <= file.size() - offset;
}

// Texels must be linear: the transfer function is the third byte of the basic descriptor's third word.
Status check_descriptor(std::span<const std::byte> file, const Ktx2Header& header) {
  if (header.dfd_bytes < 28 || !within(file, header.dfd_offset, header.dfd_bytes))
    return bad_texture("the data format descriptor of the KTX2 file is not inside the file");
  const auto transfer = static_cast<uint32_t>(file[header.dfd_offset + 14]);
  if (transfer != kTransferLinear && transfer != kTransferUnspecified)
    return bad_texture(text(
        "the texels of the KTX2 file have transfer function {}, only linear ones are supported", transfer));
  return {};
}

Status check_orientation(std::span<const std::byte> file, const Ktx2Header& header) {
  if (!within(file, header.kvd_offset, header.kvd_bytes))
    return bad_texture("the key/value data of the KTX2 file are not inside the file");
  std::span<const std::byte> rest = file.subspan(header.kvd_offset, header.kvd_bytes);
  while (!rest.empty()) {
    uint32_t size = 0;
    if (rest.size() >= 4) std::memcpy(&size, rest.data(), 4);
    if (size < 2 || size > rest.size() - 4)
      return bad_texture("a pair of the key/value data of the KTX2 file is longer than they are");
    const std::string_view pair(reinterpret_cast<const char*>(rest.data()) + 4, size);
    constexpr std::string_view kKey("KTXorientation\0", 15);
    if (pair.starts_with(kKey) && !pair.substr(kKey.size()).starts_with("rd"))
      return bad_texture(
          text("KTXorientation of the KTX2 file is \"{}\", only \"rd\" (row 0 on top) is supported",
               pair.substr(kKey.size(), 2)));
    rest = rest.subspan(std::min<size_t>(rest.size(), 4 + (uint64_t{size} + 3) / 4 * 4));
  }
  return {};
}

Status read_level(std::span<const std::byte> file, const Ktx2Header& header, const Ktx2Level& at,
                  uint32_t level, TextureImages& texture) {
  const uint64_t image =
      image_bytes(texture.format, level_side(header.width, level), level_side(header.height, level));
  const uint64_t bytes = image * texture.levels[level].size();
  if (!within(file, at.offset, at.bytes))
    return bad_texture(text("level {} of the KTX2 file is not inside the file", level));
  std::span<const std::byte> data = file.subspan(at.offset, at.bytes);
  if (at.unpacked_bytes != bytes || (header.supercompression == kKtx2None && at.bytes != bytes))
    return bad_texture(text("level {} of the KTX2 file states {} bytes, its texels take {}", level,
                            at.unpacked_bytes, bytes));
  Bytes unpacked;
  if (header.supercompression == kKtx2Zstd) {
    if (bytes > decompressed_bound(at.bytes))
      return bad_texture(text("level {} of the KTX2 file has {} bytes of zstd, which cannot hold {}", level,
                              at.bytes, bytes));
    Expected<Bytes> result = decompress(data, bytes);
    if (!result) return bad_texture(text("level {} of the KTX2 file: {}", level, result.error().message));
    unpacked = std::move(*result);
    data = unpacked;
  }
  for (size_t layer = 0; layer < texture.levels[level].size(); ++layer) {
    const auto part = data.subspan(layer * image, image);
    texture.levels[level][layer].assign(part.begin(), part.end());
  }
  return {};
}

}  // namespace

Expected<TextureImages> read_ktx2(std::span<const std::byte> file, uint64_t max_bytes) {
  if (file.size() < sizeof(Ktx2Header))
    return bad_texture("this is not a KTX2 file: it is shorter than its header");
  Ktx2Header header;
  std::memcpy(&header, file.data(), sizeof header);
  if (header.identifier != kKtx2Identifier)
    return bad_texture("this is not a KTX2 file: it does not begin with its identifier");
  const auto format = format_of_vulkan(header.vk_format);
  if (!format) return bad_texture(text("VkFormat {} of the KTX2 file is not supported", header.vk_format));
  if (header.faces != 1 || header.depth > 1)
    return bad_texture("the KTX2 file is a cube or a volume, only flat textures are supported");
  if (header.supercompression != kKtx2None && header.supercompression != kKtx2Zstd)
    return bad_texture(
        text("supercompression scheme {} of the KTX2 file is not supported, only none and zstd are",
             header.supercompression));
  const uint32_t layers = std::max(1u, header.layers), levels = std::max(1u, header.levels);
  KILN_TRY_STATUS(check_sizes(header.width, header.height, layers, levels));
  const uint64_t bytes = texture_bytes(*format, header.width, header.height, layers, levels);
  if (bytes > max_bytes)
    return bad_texture(text("the KTX2 file has {} bytes of texels, the limit is {}", bytes, max_bytes));
  if (!within(file, sizeof header, levels * sizeof(Ktx2Level)))
    return bad_texture("the KTX2 file ends within its level index");
  KILN_TRY_STATUS(check_descriptor(file, header));
  KILN_TRY_STATUS(check_orientation(file, header));
  std::vector<Ktx2Level> index(levels);
  std::memcpy(index.data(), &file[sizeof header], levels * sizeof(Ktx2Level));
  TextureImages texture{*format, header.width, header.height, {}};
  texture.levels.assign(levels, std::vector<Bytes>(layers));
  for (uint32_t level = 0; level < levels; ++level)
    KILN_TRY_STATUS(read_level(file, header, index[level], level, texture));
  return texture;
}

}  // namespace kiln
