#include "coordinator/farm/queue/disk_calls.h"

#include <unistd.h>

namespace kiln {

ssize_t DiskCalls::write_at(int file, const void* data, size_t size, off_t offset) {
  return ::pwrite(file, data, size, offset);
}
int DiskCalls::sync(int file) {
  return ::fdatasync(file);
}
int DiskCalls::truncate(int file, off_t size) {
  return ::ftruncate(file, size);
}

DiskCalls& real_disk_calls() {
  static DiskCalls calls;
  return calls;
}

}  // namespace kiln
