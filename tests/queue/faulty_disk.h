// Faults at the n-th change of a disk, whether the spool makes it (DiskCalls) or SQLite (a VFS around its
// own).
#pragma once

#include <atomic>
#include <cstdint>

#include "coordinator/farm/queue/disk_calls.h"

namespace kiln::test {

enum class Fault { kNone, kWriteError, kNoSpace, kSyncError, kDie };

// Counts every write, sync and truncation; `fault` strikes at the ones from `first` on, `times` of them.
// Writes fail half done. A sync error strikes at syncs only, the two others at writes and truncations only;
// kDie ends the process by SIGKILL, in the middle of a write.
class FaultyDisk final : public DiskCalls {
 public:
  FaultyDisk();  // from now on SQLite's files are under it too
  ~FaultyDisk();
  void arm(Fault fault, int64_t first, int64_t times);
  int64_t count() const { return count_; }  // since arm()
  int64_t struck() const { return struck_; }

  ssize_t write_at(int file, const void* data, size_t size, off_t offset) override;
  int sync(int file) override;
  int truncate(int file, off_t size) override;

  // For each operation: does the fault strike?
  bool strikes(bool is_sync);
  Fault fault() const { return fault_; }

 private:
  std::atomic<Fault> fault_{Fault::kNone};
  std::atomic<int64_t> first_{0}, times_{0}, count_{0}, struck_{0};
};

}  // namespace kiln::test
