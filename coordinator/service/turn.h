// Which job is begun next, as a pure function of the records.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "coordinator/farm/queue/records.h"

namespace kiln {

// Of the jobs that are queued, not paused and allowed by `may_begin`: one of the user with the fewest active
// jobs, of those the highest priority, of those the oldest. 0: none.
JobId next_job(const std::vector<JobRecord>& jobs, const std::function<bool(JobId)>& may_begin);

// What a waiting job waits for has come, or cannot come any more.
struct WaitEnd {
  JobId job = 0;
  std::string failure;  // empty: it may begin
};
std::vector<WaitEnd> ended_waits(const std::vector<JobRecord>& jobs);

inline bool is_active(JobState state) {
  return state == JobState::kPreparing || state == JobState::kBaking || state == JobState::kFinishing;
}

}  // namespace kiln
