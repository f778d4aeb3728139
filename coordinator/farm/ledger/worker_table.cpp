#include "coordinator/farm/ledger/worker_table.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {

WorkerTable::Ref WorkerTable::add(WorkerId id, const WorkerTraits& traits, IdentityId identity, int64_t now) {
  KILN_CHECK(!workers_.count(id));
  Worker& worker = workers_[id];
  worker.traits = traits;
  worker.traits.threads = std::max(1u, traits.threads);
  worker.identity = identity;
  worker.last_heard = worker.charged_until = now;
  return {id, &worker};
}

void WorkerTable::remove(const Ref& ref) {
  KILN_CHECK(ref->leases.empty() && !ref->counted_for);
  workers_.erase(ref.id_);
}

WorkerTable::Ref WorkerTable::find(WorkerId id) {
  const auto it = workers_.find(id);
  return {id, it == workers_.end() ? nullptr : &it->second};
}

const WorkerTable::Worker* WorkerTable::find(WorkerId id) const {
  const auto it = workers_.find(id);
  return it == workers_.end() ? nullptr : &it->second;
}

uint32_t WorkerTable::present() const {
  return static_cast<uint32_t>(std::count_if(workers_.begin(), workers_.end(), [](const auto& w) {
    return w.second.presence == Presence::kActive;
  }));
}

void WorkerTable::bench(const Ref& ref, int64_t until) {
  ref.worker_->benched_until = until;
  ++ref.worker_->benched;
}

void WorkerTable::lift_ban(WorkerId id, JobId job) {
  if (const auto it = workers_.find(id); it != workers_.end()) it->second.banned.erase(job);
}

void WorkerTable::prove(const Ref& ref, JobId job, const std::string& numeric_class) {
  KILN_CHECK(units_.find(job));
  ref.worker_->classes[job] = numeric_class;
}

void WorkerTable::assign(const Ref& ref, JobId job, int64_t now) {
  KILN_CHECK(ref->leases.empty() && units_.find(job));
  unassign(ref, now);
  ref.worker_->job = job;
  ref.worker_->assigned_at = now;
  count_for(ref, units_.at(job).user);
}

void WorkerTable::make_ready(const Ref& ref, uint32_t credits, int64_t now) {
  KILN_CHECK(ref->job != 0);
  ref.worker_->ready = true;
  ref.worker_->credits = credits;
  ref.worker_->assigned_at = ref.worker_->charged_until = now;
}

void WorkerTable::unassign(const Ref& ref, int64_t now) {
  charge(ref, now);
  count_for(ref, std::nullopt);
  ref.worker_->job = 0;
  ref.worker_->ready = ref.worker_->leaving = false;
  ref.worker_->credits = 0;
}

void WorkerTable::count_for(const Ref& ref, std::optional<UserId> user) {
  const double threads = ref->traits.threads;
  if (ref->counted_for) share_.add_threads(*ref->counted_for, -threads);
  ref.worker_->counted_for = user;
  if (user) share_.add_threads(*user, threads);
}

void WorkerTable::forget_job(JobId job) {
  for (auto& [id, worker] : workers_) {
    worker.banned.erase(job);
    worker.classes.erase(job);
    std::erase_if(worker.failed_units, [&](const auto& failed) { return failed.first == job; });
  }
  lacks_.erase(job);
}

bool WorkerTable::may_work(JobId id, const UnitTable::Job& job, const Worker& worker) {
  return !job.traits.paused && !worker.banned.count(id);
}

void WorkerTable::charge(const Ref& ref, int64_t now) {
  const UnitTable::Job* job = ref->leases.empty() ? nullptr : units_.find(ref->job);
  if (job)
    share_.charge(job->user, static_cast<double>(now - ref->charged_until) * ref->traits.threads,
                  job->weight);
  ref.worker_->charged_until = now;
}

const WorkerTable::Lack& WorkerTable::lack(JobId job) const {
  static const Lack none;
  const auto it = lacks_.find(job);
  return it == lacks_.end() ? none : it->second;
}

void WorkerTable::set_alone(JobId job, int64_t since, bool alone) {
  KILN_CHECK(units_.find(job) && (since >= 0 || !alone));
  lacks_[job].alone_since = since;
  lacks_[job].alone = alone;
}

void WorkerTable::set_stuck(JobId job, int64_t since) {
  KILN_CHECK(units_.find(job));
  lacks_[job].stuck_since = since;
}

void WorkerTable::note_other_class(JobId job, WorkerId worker, const std::string& numeric_class) {
  KILN_CHECK(units_.find(job));
  lacks_[job].other_class[worker] = numeric_class;
}

void WorkerTable::clear_other_class(JobId job) {
  const auto it = lacks_.find(job);
  KILN_CHECK(it != lacks_.end());
  it->second.other_class.clear();
}

std::string WorkerTable::audit() const {
  std::vector<double> threads(share_.size());
  for (const auto& [id, worker] : workers_) {
    if (worker.counted_for) threads[*worker.counted_for] += worker.traits.threads;
    if (worker.job == 0 && (worker.ready || worker.leaving || worker.counted_for || worker.credits > 0))
      return text("worker {} has no job, but is ready for one, leaves one or is counted for one", id);
    if (worker.job != 0 && !worker.counted_for)
      return text("worker {} serves job {} for nobody", id, worker.job);
    if (worker.job != 0 && !units_.find(worker.job)) return text("worker {} serves a job that has ended", id);
    for (const auto& [job, numeric_class] : worker.classes)
      if (!units_.find(job)) return text("worker {} proved its class for a job that has ended", id);
  }
  for (UserId user = 0; user < threads.size(); ++user)
    if (share_.threads(user) != threads[user]) return text("threads of {} are miscounted", share_.name(user));
  for (const auto& [job, lack] : lacks_)
    if (!units_.find(job)) return text("job {} has ended and is still said to lack workers", job);
  return {};
}

}  // namespace kiln
