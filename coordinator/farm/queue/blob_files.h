// Files of the blob store: hashing, copying, and the time of last use, which is the modification time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "common/base/hash.h"
#include "coordinator/farm/queue/open_file.h"

namespace kiln {

inline constexpr const char* kPartEnding = ".part";       // an upload under way
inline constexpr const char* kCopyEnding = ".copy";       // a copy under way
inline constexpr const char* kDamagedFolder = "damaged";  // blobs that were set aside

struct HashedFile {
  Digest digest;
  uint64_t size = 0;
};
// Called with the bytes of each piece that was read; false ends the reading (kUnavailable).
using ReadPace = std::function<bool(uint64_t bytes)>;
Expected<HashedFile> hash_file(const OpenFile& file, const ReadPace& pace = {});
// Fails (kInvalidInput) if `in` has more than `most` bytes.
Expected<HashedFile> copy_file(const OpenFile& in, const OpenFile& out, DiskCalls& disk, uint64_t most);

// Whether `path` names that file still.
bool is_file_at(const OpenFile& file, const std::filesystem::path& path);

bool set_last_use(const std::filesystem::path& path, int64_t now_ms);  // false if there is no such file
std::optional<int64_t> last_use(const std::filesystem::path& path);    // ms

}  // namespace kiln
