#include "tests/queue/faulty_disk.h"

#include <signal.h>
#include <sqlite3.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace kiln::test {
namespace {

FaultyDisk* active = nullptr;

// SQLite's file with ours in front.
struct ShimFile {
  sqlite3_file base;
  sqlite3_file* real() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};
ShimFile* shim(sqlite3_file* file) {
  return reinterpret_cast<ShimFile*>(file);
}
sqlite3_file* real(sqlite3_file* file) {
  return shim(file)->real();
}

int file_close(sqlite3_file* f) {
  return real(f)->pMethods->xClose(real(f));
}
int file_read(sqlite3_file* f, void* data, int size, sqlite3_int64 at) {
  return real(f)->pMethods->xRead(real(f), data, size, at);
}
int file_write(sqlite3_file* f, const void* data, int size, sqlite3_int64 at) {
  if (active && active->strikes(false)) {
    real(f)->pMethods->xWrite(real(f), data, size / 2, at);
    if (active->fault() == Fault::kDie) ::raise(SIGKILL);
    return active->fault() == Fault::kNoSpace ? SQLITE_FULL : SQLITE_IOERR_WRITE;
  }
  return real(f)->pMethods->xWrite(real(f), data, size, at);
}
int file_truncate(sqlite3_file* f, sqlite3_int64 size) {
  if (active && active->strikes(false)) {
    if (active->fault() == Fault::kDie) ::raise(SIGKILL);
    return SQLITE_IOERR_TRUNCATE;
  }
  return real(f)->pMethods->xTruncate(real(f), size);
}
int file_sync(sqlite3_file* f, int flags) {
  if (active && active->strikes(true)) return SQLITE_IOERR_FSYNC;
  return real(f)->pMethods->xSync(real(f), flags);
}
int file_size(sqlite3_file* f, sqlite3_int64* size) {
  return real(f)->pMethods->xFileSize(real(f), size);
}
int file_lock(sqlite3_file* f, int level) {
  return real(f)->pMethods->xLock(real(f), level);
}
int file_unlock(sqlite3_file* f, int level) {
  return real(f)->pMethods->xUnlock(real(f), level);
}
int file_reserved(sqlite3_file* f, int* out) {
  return real(f)->pMethods->xCheckReservedLock(real(f), out);
}
int file_control(sqlite3_file* f, int op, void* argument) {
  return real(f)->pMethods->xFileControl(real(f), op, argument);
}
int file_sector(sqlite3_file* f) {
  return real(f)->pMethods->xSectorSize(real(f));
}
int file_device(sqlite3_file* f) {
  return real(f)->pMethods->xDeviceCharacteristics(real(f));
}

// Version 1: no shared memory, which a database of one process has no need of.
constexpr sqlite3_io_methods kMethods = {
    1,         file_close,  file_read,     file_write,   file_truncate, file_sync,   file_size,
    file_lock, file_unlock, file_reserved, file_control, file_sector,   file_device, nullptr,
    nullptr,   nullptr,     nullptr,       nullptr,      nullptr};

sqlite3_vfs* plain = nullptr;
sqlite3_vfs ours;

int open_file(sqlite3_vfs*, const char* name, sqlite3_file* f, int flags, int* out) {
  f->pMethods = nullptr;
  const int code = plain->xOpen(plain, name, real(f), flags, out);
  if (real(f)->pMethods) f->pMethods = &kMethods;
  return code;
}

}  // namespace

FaultyDisk::FaultyDisk() {
  plain = sqlite3_vfs_find("unix");
  ours = *plain;
  ours.zName = "kiln-faults";
  ours.szOsFile = static_cast<int>(sizeof(ShimFile)) + plain->szOsFile;
  ours.xOpen = open_file;
  sqlite3_vfs_register(&ours, 1);
  active = this;
}

FaultyDisk::~FaultyDisk() {
  active = nullptr;
  sqlite3_vfs_unregister(&ours);
  sqlite3_vfs_register(plain, 1);
}

void FaultyDisk::arm(Fault fault, int64_t first, int64_t times) {
  fault_ = Fault::kNone;
  first_ = first;
  times_ = times;
  count_ = struck_ = 0;
  fault_ = fault;
}

bool FaultyDisk::strikes(bool is_sync) {
  const int64_t number = count_++;
  if (fault_ == Fault::kNone || number < first_ || struck_ >= times_) return false;
  if (fault_ != Fault::kDie && is_sync != (fault_ == Fault::kSyncError)) return false;
  if (fault_ == Fault::kDie && is_sync) ::raise(SIGKILL);
  ++struck_;
  return true;
}

ssize_t FaultyDisk::write_at(int file, const void* data, size_t size, off_t offset) {
  if (!strikes(false)) return DiskCalls::write_at(file, data, size, offset);
  // Half of it, then the error: as one call, because the second would be told of it.
  (void)!DiskCalls::write_at(file, data, size / 2, offset);
  if (fault_ == Fault::kDie) ::raise(SIGKILL);
  errno = fault_ == Fault::kNoSpace ? ENOSPC : EIO;
  return -1;
}

int FaultyDisk::sync(int file) {
  if (!strikes(true)) return DiskCalls::sync(file);
  errno = EIO;
  return -1;
}

int FaultyDisk::truncate(int file, off_t size) {
  if (!strikes(false)) return DiskCalls::truncate(file, size);
  if (fault_ == Fault::kDie) ::raise(SIGKILL);
  errno = EIO;
  return -1;
}

}  // namespace kiln::test
