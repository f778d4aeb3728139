// The system calls by which the store changes files: tests inject faults here.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>

namespace kiln {

// As the system calls: -1 and errno on failure.
class DiskCalls {
 public:
  virtual ~DiskCalls() = default;
  virtual ssize_t write_at(int file, const void* data, size_t size, off_t offset);  // pwrite
  virtual int sync(int file);                                                       // fdatasync
  virtual int truncate(int file, off_t size);
  virtual int free_bytes(const char* folder, uint64_t& bytes);  // statvfs: what this user may still write
};

DiskCalls& real_disk_calls();

}  // namespace kiln
