// Which job starts next, as a pure function of the records.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "coordinator/farm/queue/records.h"

namespace kiln {

// Among jobs that are queued, not paused and allowed by `may_begin`: takes users with the fewest
// active jobs, then the highest priority, then the oldest job. 0: none.
JobId next_job(const std::vector<JobRecord>& jobs, const std::function<bool(JobId)>& may_begin);

// Whether a waiting job's dependency is done, or can no longer be.
struct WaitEnd {
  JobId job = 0;
  std::string failure;  // empty: the job may start
};
std::vector<WaitEnd> ended_waits(const std::vector<JobRecord>& jobs);

inline bool is_active(JobState state) {
  return state == JobState::kPreparing || state == JobState::kBaking || state == JobState::kFinishing;
}

}  // namespace kiln
