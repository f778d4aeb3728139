// Bounded reads, and writes by rename: a file appears complete or not at all.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace kiln {

// The whole file. Fails with the path and the reason; files above max_bytes are refused unread.
Expected<Bytes> read_file(const std::filesystem::path& path, uint64_t max_bytes = uint64_t{1} << 36);

// Writes a temporary file beside `path`, syncs it and renames it over `path`.
Status write_file_atomic(const std::filesystem::path& path, std::span<const std::byte> data);
Status write_file_atomic(const std::filesystem::path& path, std::string_view text);
// The same, readable by its owner only from the first byte on (mode 0600).
Status write_private_file(const std::filesystem::path& path, std::string_view text);

// The same for writers that need a path: `write` receives the temporary path (same extension).
Status write_atomic(const std::filesystem::path& path,
                    const std::function<Status(const std::filesystem::path&)>& write);

// Creates the folder if needed and checks that a file can be written there and that `need_bytes` are free.
Status prepare_output_folder(const std::filesystem::path& folder, uint64_t need_bytes);

}  // namespace kiln
