// OpenEXR files: single part, scan lines, ZIP or plain; masters are 32-bit float.
#pragma once

#include <filesystem>
#include <map>
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

// What a file says of itself: text attributes of its header, by name without the prefix "kiln:".
using ExrNotes = std::map<std::string, std::string>;

struct ExrForm {
  ExrType type = ExrType::kFloat;
  ExrCompression compression = ExrCompression::kZip;
};

// Writes by rename. The header gets `notes`, and the program's version as "kiln:version".
Status write_exr(const std::filesystem::path& path, uint32_t width, uint32_t height,
                 std::span<const ExrChannel> channels, ExrForm form = {}, const ExrNotes& notes = {});

// Reads all channels of a scan-line file as float planes. At most max_texels.
Expected<Planes> read_exr(const std::filesystem::path& path, uint64_t max_texels = uint64_t{1} << 28);

// The notes of a file; empty for files of other programs. Fails as read_exr does.
Expected<ExrNotes> read_exr_notes(const std::filesystem::path& path);

}  // namespace kiln
