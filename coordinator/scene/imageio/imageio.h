// Image files in and out, by OpenImageIO (image_library.h), OpenEXR (exr.h) and libavif (avif.h).
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "common/base/bytes.h"
#include "common/base/status.h"
#include "common/image/image.h"
#include "coordinator/scene/imageio/memory_gate.h"

namespace kiln {

// Decodes a colour image (PNG, JPEG, WebP, AVIF, ...) to kUnorm8, 1 to 4 channels. `name` is for
// messages. Refused before they are decoded: images above 16384 texels a side, above 1 GiB, or above 256 MiB
// and 64 times the file, which only a picture of next to nothing is. `hold` takes memory for the texels and a
// copy.
Expected<Texture> decode_image(std::span<const std::byte> file, const std::string& name,
                               MemoryGate::Hold* hold = nullptr);

// Reads an equirectangular HDR or EXR (or any image) as kFloat32 RGB, in the file's own unit, linear.
// Up to 1 GiB, and 512 MiB and 64 times the file. Errors (kInvalidInput) name the file and the first texel
// that is NaN, infinite or negative.
Expected<Texture> read_environment(const std::filesystem::path& path);

// Writes 8-bit RGB (3 bytes a texel, row 0 on top) as PNG, by rename.
Status write_png(const std::filesystem::path& path, uint32_t width, uint32_t height,
                 std::span<const uint8_t> rgb);
// The same in memory, for embedding in a page. `channels`: 3, or 4 with alpha that is not premultiplied.
Expected<Bytes> encode_png(uint32_t width, uint32_t height, std::span<const uint8_t> texels,
                           uint32_t channels = 3);

}  // namespace kiln
