#include "coordinator/farm/queue/spool.h"

#include <fcntl.h>

#include <utility>

#include "common/base/check.h"
#include "coordinator/farm/queue/spool_record.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr uint64_t kWriteAt = uint64_t{4}
                              << 20;  // a group is written to the kernel in pieces of about this size
constexpr size_t kMaxOpenJobs = 64;   // jobs with a file open between groups

}  // namespace

Expected<SpoolPlace> Spool::append(const UnitCommit& commit, std::span<const std::byte> payload) {
  KILN_CHECK(commit.job != 0 && payload.size() <= kMaxPayloadBytes);
  JobFiles& files = jobs_[commit.job];
  const uint64_t size = kSpoolHead + payload.size();
  if (files.open.empty() || files.open.back().end() + size > file_bytes_) {
    KILN_TRY_STATUS(begin_file(commit.job, files));
  }
  KILN_CHECK(!files.open.empty());
  files.in_group = true;
  File& file = files.open.back();
  const SpoolPlace place{epoch_, file.number, file.end()};
  const auto head = write_spool_head(commit, payload);
  file.waiting.insert(file.waiting.end(), head.begin(), head.end());
  file.waiting.insert(file.waiting.end(), payload.begin(), payload.end());
  // sync() retries failures here from the same offset.
  if (file.waiting.size() >= kWriteAt) (void)write_waiting(file);
  return place;
}

Status Spool::begin_file(JobId job, JobFiles& files) {
  const fs::path folder = spool_folder(folder_, job);
  if (!files.folder_made) {
    KILN_TRY_STATUS(make_folder(disk_, folder));
    files.folder_made = true;
  }
  const uint32_t number = files.next++;
  KILN_CHECK(files.open.empty() || files.open.back().number < number);  // names are not used again
  OpenFile opened(spool_path(folder_, {job, epoch_, number}), O_WRONLY | O_CREAT | O_EXCL);
  if (!opened.is_open()) return system_error("create", opened.path());
  File& file = files.open.emplace_back();
  file.file = std::move(opened);
  file.number = number;
  return {};
}

Status Spool::write_waiting(File& file) {
  KILN_TRY_STATUS(file.file.write_at(disk_, file.waiting, file.written));
  KILN_CHECK(file.written >= file.durable);
  file.written += file.waiting.size();
  file.waiting.clear();
  return {};
}

Status Spool::sync_job(JobId job, JobFiles& files) {
  KILN_CHECK(!files.open.empty());
  bool fresh = false;
  for (File& file : files.open) {
    KILN_TRY_STATUS(write_waiting(file));
    KILN_TRY_STATUS(file.file.sync(disk_));
    fresh = fresh || file.fresh;
  }
  if (fresh) KILN_TRY_STATUS(sync_folder(disk_, spool_folder(folder_, job)));
  for (File& file : files.open) {
    KILN_CHECK(file.waiting.empty());
    file.durable = file.written;
    file.fresh = false;
  }
  files.open.erase(files.open.begin(), files.open.end() - 1);
  return {};
}

std::map<JobId, Error> Spool::sync() {
  std::map<JobId, Error> failed;
  for (auto& [job, files] : jobs_) {
    if (!std::exchange(files.in_group, false)) continue;
    KILN_CHECK(files.folder_made);
    const Status status = sync_job(job, files);
    if (status) continue;
    failed.emplace(job, status.error());
    // The files end here: referenced records stay, and the rest is truncated if the disk allows it.
    for (File& file : files.open) {
      if (file.durable > 0) {
        (void)disk_.truncate(file.file.number(), static_cast<off_t>(file.durable));
      } else {
        std::error_code ignored;
        fs::remove(file.file.path(), ignored);
      }
    }
    files.open.clear();
    files.folder_made = false;
  }
  close_idle();
  return failed;
}

void Spool::close_idle() {
  size_t open = 0;
  for (const auto& [job, files] : jobs_) open += files.open.empty() ? 0 : 1;
  for (auto it = jobs_.begin(); open > kMaxOpenJobs && it != jobs_.end(); ++it) {
    if (it->second.open.empty()) continue;
    it->second.open.clear();
    --open;
  }
}

void Spool::drop(JobId job) {
  // The counter is kept: a name is never reused, in case a file survives its removal.
  if (const auto it = jobs_.find(job); it != jobs_.end()) {
    it->second.open.clear();
    it->second.folder_made = it->second.in_group = false;
  }
  std::error_code ignored;
  fs::remove_all(spool_folder(folder_, job), ignored);
}

}  // namespace kiln
