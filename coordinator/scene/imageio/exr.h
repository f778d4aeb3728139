// OpenEXR files: single part, scan lines, ZIP or plain; masters are 32-bit float.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/image/image.h"

namespace kiln {

struct ExrChannel {
  std::string name;
  const float* data;  // width * height, row 0 on top
};

enum class ExrType { kFloat, kHalf };  // a value beyond 65504 becomes infinite in a half
enum class ExrCompression { kZip, kNone };

// Writes by rename.
Status write_exr(const std::filesystem::path& path, uint32_t width, uint32_t height,
                 std::span<const ExrChannel> channels, ExrType type = ExrType::kFloat,
                 ExrCompression compression = ExrCompression::kZip);

// Reads all channels of a scan-line file as float planes. At most max_texels.
Expected<Planes> read_exr(const std::filesystem::path& path, uint64_t max_texels = uint64_t{1} << 28);

}  // namespace kiln
