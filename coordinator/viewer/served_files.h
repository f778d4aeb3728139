// Files below a folder, by the path of a request: nothing above it, nothing hidden, nothing behind a symbolic
// link.
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
  // Up to `size` bytes from `offset` on; 0 at the end or on an error.
  size_t read(uint64_t offset, char* to, size_t size) const;

 private:
  int descriptor_;
  uint64_t size_;
};

// `path`: names with slashes between them, decoded. Opened step by step, so that no link that appears
// meanwhile is followed. Errors (kInvalidInput) are sentences for who asked.
Expected<std::shared_ptr<const ServedFile>> open_below(const std::filesystem::path& folder,
                                                       std::string_view path);

// By the ending of a name; application/octet-stream where it is not known.
const char* mime_type_of(std::string_view path);

}  // namespace kiln
