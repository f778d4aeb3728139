// Chooses the job that a worker serves: by the user's turn, then priority, then age.
#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {

bool FarmLedger::may_work(JobId id, const Job& job, const Worker& worker) const {
  return !job.traits.paused && !worker.banned.count(id);
}

// Whether there is a unit for the worker now.
bool FarmLedger::has_work(const Job& job, const Worker& worker) const {
  if (!job.open) return false;
  return !job.pending.empty() || job.spare || choose_suspect(worker, job) || choose_second(worker, job);
}

// Virtual time of the job's user after one residence of all workers that would serve it; the smallest is
// next.
double FarmLedger::turn(const Job& job, double more_threads) const {
  const double threads = share_.threads(job.user) + more_threads;
  return share_.virtual_time(job.user) + threads * static_cast<double>(rules_.residence_ms) / job.weight;
}

JobId FarmLedger::pick_job(const Worker& worker) const {
  JobId best = 0;
  double best_turn = 0;
  const Job* best_job = nullptr;
  for (const auto& [id, job] : jobs_) {
    if (!may_work(id, job, worker) || !has_work(job, worker)) continue;
    const bool same_user = best_job && job.user == best_job->user;
    const double its_turn = turn(job, worker.counted_for == job.user ? 0 : worker.traits.threads);
    const bool better =
        !best_job || (same_user ? job.traits.priority > best_job->traits.priority : its_turn < best_turn);
    if (!better) continue;
    best = id;
    best_turn = its_turn;
    best_job = &job;
  }
  return best;
}

void FarmLedger::count_for(Worker& worker, std::optional<UserId> user) {
  if (worker.counted_for)
    share_.add_threads(*worker.counted_for, -static_cast<double>(worker.traits.threads));
  worker.counted_for = user;
  if (user) share_.add_threads(*user, worker.traits.threads);
}

void FarmLedger::assign(WorkerId id, Worker& worker, JobId job, int64_t now, Actions& out) {
  KILN_CHECK(worker.held.empty() && jobs_.count(job) == 1);
  unassign(worker, now);
  worker.job = job;
  worker.assigned_at = now;
  count_for(worker, jobs_.at(job).user);
  out.push_back(Assign{id, job});
}

void FarmLedger::unassign(Worker& worker, int64_t now) {
  charge(worker, now);
  count_for(worker, std::nullopt);
  worker.job = 0;
  worker.ready = worker.leaving = false;
  worker.credits = 0;
}

void FarmLedger::find_spare(int64_t now) {
  for (auto& [id, job] : jobs_) job.spare = job.open && (!job.backlogs.empty() || choose_copy(0, job, now));
}

void FarmLedger::wake_users() {
  std::vector<char> runnable(share_.size());
  for (const auto& [id, job] : jobs_)
    runnable[job.user] |= job.open && !job.traits.paused && (!job.pending.empty() || !job.leases.empty());
  for (UserId user = 0; user < runnable.size(); ++user)
    runnable[user] ? share_.wake(user) : share_.sleep(user);
}

// A worker leaves its job when it is another user's turn by more than half a residence of this worker, or
// when the same user has something more urgent. It finishes the units it holds.
void FarmLedger::balance(int64_t now) {
  wake_users();
  for (auto& [id, worker] : workers_) {
    if (!worker.ready || worker.leaving || now - worker.assigned_at < rules_.residence_ms) continue;
    const Job* job = find_job(worker.job);
    const JobId next = job ? pick_job(worker) : 0;
    if (next == 0 || next == worker.job) continue;
    const Job& other = jobs_.at(next);
    const double slack =
        0.5 * static_cast<double>(rules_.residence_ms) * worker.traits.threads / other.weight;
    worker.leaving = other.user == job->user ? other.traits.priority > job->traits.priority
                                             : turn(*job, 0) > turn(other, worker.traits.threads) + slack;
    if (worker.leaving) count_for(worker, other.user);
  }
}

}  // namespace kiln
