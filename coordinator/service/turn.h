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

// JobRecord::preparations bounds a job that crashes its conductor. From the first time that all its units are
// there it counts from kFinishings: such a job is worth more than another attempt, so it is tried again with
// growing pauses, then kept, and never failed for the deaths.
constexpr uint32_t kMaxPreparations = 10, kFinishings = 1000;
inline bool has_finished_baking(const JobRecord& job) {
  return job.preparations >= kFinishings;
}
inline bool is_to_be_kept(const JobRecord& job) {
  return job.preparations >= kFinishings + kMaxPreparations;
}
// Whether it waits for `kiln retry` with all its units.
inline bool is_kept(const JobRecord& job) {
  return job.state == JobState::kQueued && job.paused && is_to_be_kept(job);
}
// Before it is begun again: 1 s after the first attempt to finish it, doubled for each further one.
int64_t finishing_pause_ms(const JobRecord& job);

inline bool is_active(JobState state) {
  return state == JobState::kPreparing || state == JobState::kBaking || state == JobState::kFinishing;
}

}  // namespace kiln
