// In-memory copy of the jobs and workers on disk, for all threads.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/base/check.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

// A transaction's changes; nullopt: removed.
struct RecordChanges {
  std::map<JobId, std::optional<JobRecord>> jobs;
  std::map<std::string, WorkerRecord> workers;
};

class RecordCache {
 public:
  RecordCache(std::map<JobId, JobRecord> jobs, std::map<std::string, WorkerRecord> workers)
      : jobs_(std::move(jobs)), workers_(std::move(workers)) {}

  std::vector<JobRecord> jobs() const {
    const std::lock_guard lock(mutex_);
    std::vector<JobRecord> all;
    for (const auto& [id, job] : jobs_) all.push_back(job);
    return all;
  }
  std::vector<JobId> ids() const {
    const std::lock_guard lock(mutex_);
    std::vector<JobId> all;
    for (const auto& [id, job] : jobs_) all.push_back(id);
    return all;
  }
  std::optional<JobRecord> job(JobId id) const {
    const std::lock_guard lock(mutex_);
    const auto it = jobs_.find(id);
    return it == jobs_.end() ? std::nullopt : std::optional(it->second);
  }
  bool has_job(JobId id) const {
    const std::lock_guard lock(mutex_);
    return jobs_.count(id) != 0;
  }
  std::vector<WorkerRecord> workers() const {
    const std::lock_guard lock(mutex_);
    std::vector<WorkerRecord> all;
    for (const auto& [identity, worker] : workers_) all.push_back(worker);
    return all;
  }
  std::optional<WorkerRecord> worker(const std::string& identity) const {
    const std::lock_guard lock(mutex_);
    const auto it = workers_.find(identity);
    return it == workers_.end() ? std::nullopt : std::optional(it->second);
  }
  void apply(RecordChanges changes) {
    const std::lock_guard lock(mutex_);
    for (auto& [id, job] : changes.jobs) {
      KILN_CHECK(!job || job->id == id);
      if (job)
        jobs_.insert_or_assign(id, std::move(*job));
      else
        jobs_.erase(id);
    }
    for (auto& [identity, worker] : changes.workers) {
      KILN_CHECK(worker.identity == identity);
      workers_.insert_or_assign(identity, std::move(worker));
    }
  }

 private:
  mutable std::mutex mutex_;
  std::map<JobId, JobRecord> jobs_;
  std::map<std::string, WorkerRecord> workers_;
};

}  // namespace kiln
