// Starts jobs when it is their turn, and deletes what is too old.
#include <algorithm>

#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/service/turn.h"

namespace kiln {
namespace {

constexpr auto kLook = std::chrono::seconds(1);
// kMaxPreparations is high enough that a series of power cuts does not end a job, low enough that a scene
// that crashes the coordinator does not block the others for long.
constexpr const char* kGivenUp = "the coordinator died ten times in a row while preparing it";
constexpr const char* kKept =
    "to finish it failed ten times in a row; all its units are kept, and `kiln retry` finishes it without "
    "baking";

// Counts an attempt, before it starts: a job that crashes the coordinator must not do so forever. False:
// there have been enough, and the record says so.
bool count_attempt(JobRecord& job, int64_t now_ms) {
  if (is_to_be_kept(job)) {
    const std::string last = job.reason;
    job.paused = true;
    job.reason = last.empty() ? kKept : text("{}; the last time: {}", kKept, last).substr(0, 4000);
    return false;
  }
  if (!has_finished_baking(job) && job.preparations >= kMaxPreparations) {
    job.state = JobState::kFailed;
    job.reason = kGivenUp;
    job.ended_ms = now_ms;
    return false;
  }
  job.state = JobState::kPreparing;
  job.reason = "";
  ++job.preparations;
  if (!job.started_ms) job.started_ms = now_ms;
  return true;
}

}  // namespace

void ServiceImpl::keep() {
  while (!stopping_) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kLook, [this] { return look_ || stopping_; });
      look_ = false;
      for (auto it = active_.begin(); it != active_.end();) {
        if (!it->second->ended) {
          ++it;
          continue;
        }
        it->second->thread.join();
        it = active_.erase(it);
      }
    }
    if (stopping_) return;
    tend();
    if (!held_for().empty() || !take_up_jobs()) continue;
    end_waits();
    begin_jobs();
  }
}

void ServiceImpl::end_waits() {
  for (const WaitEnd& end : ended_waits(store_->jobs())) {
    const Status s = store_->change(end.job, [&](JobRecord& job) -> Status {
      if (job.state != JobState::kWaiting) return fail(ErrorKind::kUsage, "no longer waiting");
      job.state = end.failure.empty() ? JobState::kQueued : JobState::kFailed;
      job.reason = end.failure;
      if (!end.failure.empty()) job.ended_ms = now_ms();
      return {};
    });
    if (s) note(end.job, end.failure.empty() ? "the job it waited for is done" : end.failure);
    if (s && !end.failure.empty()) wake();
  }
}

void ServiceImpl::begin_jobs() {
  for (;;) {
    if (stopping_ || !held_for().empty()) return;
    JobId id = 0;
    {
      const std::lock_guard lock(mutex_);
      if (active_.size() >= settings_.active_jobs) return;
      const int64_t now = steady_ms();
      id = next_job(store_->jobs(), [&](JobId job) {
        const auto it = not_before_.find(job);
        return !active_.count(job) && (it == not_before_.end() || it->second <= now);
      });
    }
    if (id == 0) return;
    // From here on a cancellation finds the job.
    Active* active = nullptr;
    {
      const std::lock_guard lock(mutex_);
      active = (active_[id] = std::make_unique<Active>()).get();
      active->progress.stage = "begin";
    }
    const auto forget = [&] {
      std::string cancelled_by;
      {
        const std::lock_guard lock(mutex_);
        if (active->cancelled) cancelled_by = active->who;
        active_.erase(id);
      }
      return cancelled_by;
    };
    bool begins = false;
    std::string reason;
    const Status s = store_->change(id, [&](JobRecord& job) -> Status {
      if (job.state != JobState::kQueued || job.paused)
        return fail(ErrorKind::kUsage, "it was changed meanwhile");
      begins = count_attempt(job, now_ms());
      reason = job.reason;
      return {};
    });
    if (!s) {
      if (const std::string who = forget(); !who.empty())
        if (const Status done = cancel(id, who); !done) log_warning(done.error().message);
      return;
    }
    if (!begins) {
      forget();
      note(id, reason);
      wake();
      continue;
    }
    const std::lock_guard lock(mutex_);
    active->thread = std::thread([this, id, active] { conduct(id, *active); });
  }
}

}  // namespace kiln
