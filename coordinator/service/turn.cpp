#include "coordinator/service/turn.h"

#include <algorithm>
#include <tuple>

#include "common/base/format.h"

namespace kiln {

JobId next_job(const std::vector<JobRecord>& jobs, const std::function<bool(JobId)>& may_begin) {
  std::map<std::string, int64_t> active;
  for (const JobRecord& job : jobs) active[job.user] += is_active(job.state);
  JobId best = 0;
  std::tuple<int64_t, int64_t, JobId> best_key;
  for (const JobRecord& job : jobs) {
    if (job.state != JobState::kQueued || job.paused || !may_begin(job.id)) continue;
    const std::tuple<int64_t, int64_t, JobId> key{active[job.user], -job.priority, job.id};
    if (best && best_key < key) continue;
    best = job.id;
    best_key = key;
  }
  return best;
}

std::vector<WaitEnd> ended_waits(const std::vector<JobRecord>& jobs) {
  std::map<JobId, JobState> states;
  for (const JobRecord& job : jobs) states[job.id] = job.state;
  std::vector<WaitEnd> ends;
  for (const JobRecord& job : jobs) {
    if (job.state != JobState::kWaiting) continue;
    bool open = false;
    std::string failure;
    for (const JobId other : job.after) {
      const auto it = states.find(other);
      if (it == states.end())
        failure = text("job {}, which it waited for, was forgotten", other);
      else if (it->second == JobState::kFailed || it->second == JobState::kCancelled)
        failure = text("job {}, which it waited for, is {}", other, job_state_name(it->second));
      else if (it->second != JobState::kDone)
        open = true;
      if (!failure.empty()) break;
    }
    if (!failure.empty() || !open) ends.push_back({job.id, failure});
  }
  return ends;
}

int64_t finishing_pause_ms(const JobRecord& job) {
  constexpr int64_t kFirst = 1000, kLongest = 300'000;
  if (job.preparations <= kFinishings) return 0;
  return std::min(kLongest, kFirst << std::min(job.preparations - kFinishings - 1, 20u));
}

}  // namespace kiln
