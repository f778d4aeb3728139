// A file descriptor with its path, and system errors as messages.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "coordinator/farm/queue/disk_calls.h"

namespace kiln {

class OpenFile {
 public:
  OpenFile() = default;
  OpenFile(std::filesystem::path path, int flags);  // as open(2), close-on-exec, mode 0600
  ~OpenFile() { close(); }
  OpenFile(OpenFile&& other) noexcept;
  OpenFile& operator=(OpenFile&& other) noexcept;

  bool is_open() const { return file_ >= 0; }
  int number() const { return file_; }
  const std::filesystem::path& path() const { return path_; }
  void close();

  // Writes all of `data` at `offset`, in as many calls as needed.
  Status write_at(DiskCalls& disk, std::span<const std::byte> data, uint64_t offset) const;
  Status sync(DiskCalls& disk) const;
  // Fills `data` from `offset`; kIo if the file ends before.
  Status read_at(std::span<std::byte> data, uint64_t offset) const;

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

// "cannot DOING PATH: reason" with the current errno; kNoSpace if errno means that, else kIo.
tl::unexpected<Error> system_error(std::string_view doing, const std::filesystem::path& path);
// The same for std::filesystem.
tl::unexpected<Error> system_error(std::string_view doing, const std::filesystem::path& path,
                                   const std::error_code& code);

// The entries of a folder, by name; none if it cannot be read.
std::vector<std::filesystem::path> list_folder(const std::filesystem::path& folder);

// Makes the names in a folder durable.
Status sync_folder(DiskCalls& disk, const std::filesystem::path& folder);

// Creates the folder and missing parents, each durable in its parent.
Status make_folder(DiskCalls& disk, const std::filesystem::path& folder);

}  // namespace kiln
