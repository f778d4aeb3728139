// Files below a folder, by request path: nothing above the folder, nothing hidden, nothing behind a
// symbolic link.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace kiln {

class ServedFile {
 public:
  ServedFile(int descriptor, uint64_t size) : descriptor_(descriptor), size_(size) {}
  ~ServedFile();
  ServedFile(const ServedFile&) = delete;
  ServedFile& operator=(const ServedFile&) = delete;
  uint64_t size() const { return size_; }
  // Up to `size` bytes from `offset`; 0 at the end or on an error.
  size_t read(uint64_t offset, char* to, size_t size) const;

 private:
  int descriptor_;
  uint64_t size_;
};

// `path`: decoded, components separated by slashes. Opened component by component, so that a link
// created meanwhile is not followed. Errors (kInvalidInput) are sentences for the client.
Expected<std::shared_ptr<const ServedFile>> open_below(const std::filesystem::path& folder,
                                                       std::string_view path);

// MIME type by file extension; application/octet-stream if unknown.
const char* mime_type_of(std::string_view path);

}  // namespace kiln
