// DDS (DX10 header) and KTX2 files: array layers are pages, levels are mips. KTX2 holds volumes too, of one
// level.
#pragma once

#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/status.h"
#include "coordinator/output/container/texture_format.h"

namespace kiln {

struct TextureImages {
  TextureFormat format = TextureFormat::kRgba8Unorm;
  uint32_t width = 0, height = 0;          // of level 0; level k has max(1, side >> k)
  std::vector<std::vector<Bytes>> levels;  // [level][layer]: image_bytes each, row 0 (v = 0) first
  bool is_volume = false;                  // layers are the slices of a 3-D texture, z = 0 first
  uint32_t layers() const { return levels.empty() ? 0 : static_cast<uint32_t>(levels.front().size()); }
};

// Key and value of a KTX2 file; `KTXwriter` and `KTXorientation` are always written.
struct KtxNote {
  std::string key, value;
};

// Uses the DX10 header, except for single layers of BC1 and RGBA8, whose older names more readers know.
// Errors (kInvalidInput): no image, images of a wrong size, sides above 16384, more than 2048 layers, a
// format that DDS does not have (ASTC).
Expected<Bytes> write_dds(const TextureImages& texture);
// `zstd`: supercompression level 1 to 19, 0: none (KTX 2.0 specification, 3.13; scheme 2).
Expected<Bytes> write_ktx2(const TextureImages& texture, int zstd, const std::vector<KtxNote>& notes = {});

// Reads files of the two functions above and of other tools in the same formats: 2D textures, linear, row 0
// on top. Every size is checked before use; at most `max_bytes` of texels. Errors (kInvalidInput) name the
// field.
Expected<TextureImages> read_dds(std::span<const std::byte> file, uint64_t max_bytes = uint64_t{1} << 32);
Expected<TextureImages> read_ktx2(std::span<const std::byte> file, uint64_t max_bytes = uint64_t{1} << 32);

}  // namespace kiln
