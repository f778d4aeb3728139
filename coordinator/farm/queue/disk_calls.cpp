#include "coordinator/farm/queue/disk_calls.h"

#include <sys/statvfs.h>
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
int DiskCalls::free_bytes(const char* folder, uint64_t& bytes) {
  struct statvfs status {};
  const int code = ::statvfs(folder, &status);
  bytes = uint64_t{status.f_bavail} * status.f_frsize;
  return code;
}

DiskCalls& real_disk_calls() {
  static DiskCalls calls;
  return calls;
}

}  // namespace kiln
