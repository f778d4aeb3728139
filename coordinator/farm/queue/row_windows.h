// Rows of stored results, loaded some hundred at a time: a restarted job reads its results back in order, and
// asking the writer for each row alone would cost two thread switches a result.
//
// Loaded and forgotten on the writer thread only, so that no window outlives the removal of its rows. A row
// that is outdated in another way does no harm: records are never overwritten, and each is checked against
// its row.
#pragma once

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "common/base/check.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

class RowWindows {
 public:
  static constexpr size_t kRows = 256;  // of a window

  std::optional<CommitRow> find(JobId job, uint64_t unit, const Digest& digest) const {
    const std::lock_guard lock(mutex_);
    const auto window = windows_.find(job);
    if (window == windows_.end()) return std::nullopt;
    const auto row = std::lower_bound(
        window->second.begin(), window->second.end(), std::pair(unit, digest),
        [](const CommitRow& r, const auto& key) { return std::pair(r.unit, r.digest) < key; });
    if (row == window->second.end() || row->unit != unit || row->digest != digest) return std::nullopt;
    return *row;
  }
  // `rows`: of one job, by unit, then digest. Replaces the job's window.
  void put(JobId job, std::vector<CommitRow> rows) {
    KILN_CHECK(rows.size() <= kRows);
    KILN_CHECK(std::is_sorted(rows.begin(), rows.end(), [](const CommitRow& a, const CommitRow& b) {
      return std::pair(a.unit, a.digest) < std::pair(b.unit, b.digest);
    }));
    const std::lock_guard lock(mutex_);
    if (windows_.size() >= kJobs && !windows_.count(job)) windows_.erase(windows_.begin());
    windows_[job] = std::move(rows);
  }
  void forget(JobId job) {
    const std::lock_guard lock(mutex_);
    windows_.erase(job);
  }

 private:
  static constexpr size_t kJobs = 64;
  mutable std::mutex mutex_;
  std::map<JobId, std::vector<CommitRow>> windows_;
};

}  // namespace kiln
