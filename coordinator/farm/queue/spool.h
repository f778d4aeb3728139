// Results of units in append-only files: folder/JOB/EPOCH-FILE.spool, records back to back (docs/storage.md).
// A record counts if the database has a row for it, which is written only after the record is synced; other
// bytes are ignored and removed with the file.
//
// After a failed sync the kernel may mark pages clean that never reached the disk (fsync(2), "fsyncgate"), so
// a failed file is never appended to again, nor is one of an earlier opening.
#pragma once

#include <filesystem>
#include <map>
#include <span>

#include "common/base/bytes.h"
#include "coordinator/farm/queue/open_file.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

inline constexpr uint64_t kSpoolHead = 88;  // bytes of a record before its payload

// Position of a record.
struct SpoolPlace {
  uint64_t epoch = 0;
  uint32_t file = 0;
  uint64_t offset = 0;
};

class Spool {
 public:
  // `folder` exists. A file is full at `file_bytes`.
  Spool(std::filesystem::path folder, uint64_t epoch, uint64_t file_bytes, DiskCalls& disk)
      : folder_(std::move(folder)), epoch_(epoch), file_bytes_(file_bytes), disk_(disk) {}

  // Appends a record to its job's group. It is durable only after sync() reports it.
  Expected<SpoolPlace> append(const UnitCommit& commit, std::span<const std::byte> payload);
  // Writes and syncs the group. Returns the jobs with records not on disk, and the reason: all their records
  // since the last call must be appended again.
  std::map<JobId, Error> sync();
  // Removes the files of a job; failures are retried at the next opening.
  void drop(JobId job);

 private:
  struct File {
    OpenFile file;
    uint32_t number = 0;
    uint64_t durable = 0;  // bytes that are synced
    uint64_t written = 0;
    Bytes waiting;      // from `written` on
    bool fresh = true;  // its name is not durable yet
    uint64_t end() const { return written + waiting.size(); }
  };
  struct JobFiles {
    std::vector<File> open;  // the last receives records, the others are full and need a sync
    uint32_t next = 1;
    bool in_group = false;
    bool folder_made = false;
  };
  Status begin_file(JobId job, JobFiles& files);
  Status write_waiting(File& file);
  Status sync_job(JobId job, JobFiles& files);
  void close_idle();

  std::filesystem::path folder_;
  uint64_t epoch_, file_bytes_;
  DiskCalls& disk_;
  std::map<JobId, JobFiles> jobs_;
};

// The payload of a row, its header and checksums verified; kIo naming file and offset if they do not fit.
Expected<Bytes> read_spool_record(const std::filesystem::path& folder, const CommitRow& row);

// Once after an opening, that of `epoch`, whose own files stay: removes a job's unreferenced files and
// truncates the others after their last record. Returns a message for each file that is shorter than its rows
// require, or cannot be cleaned up.
std::vector<std::string> tidy_spool(const std::filesystem::path& folder, JobId job, uint64_t epoch,
                                    const std::map<SpoolFileId, uint64_t>& ends);

}  // namespace kiln
