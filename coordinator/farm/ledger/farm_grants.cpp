// Grants units within a job, in this order: a unit that cost a worker, alone on a worker that holds nothing;
// a unit that needs a second answer; the next unit in order; for an idle thread, a unit that another worker
// has not started; and last a copy of a late unit.
#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {
namespace {

constexpr size_t kManyWorkers = 256;  // above this, all of them are served at this rate
constexpr int64_t kPauseMs = 10;

}  // namespace

void FarmLedger::grant(const WorkerRef& worker, const UnitRef& unit, int64_t now, Actions& out) {
  if (unit->queue != Queue::kSecond) units_.dequeue(unit);
  if (worker->leases.empty()) workers_.start_charging(worker, now);
  const uint64_t lease = grants_.add(unit, worker, now);
  if (unit->queue == Queue::kSecond) {  // enough workers are asked now, or one more is needed
    units_.dequeue(unit);
    units_.enqueue(unit);
  }
  out.push_back(Grant{worker.id(), unit.job_id(), lease, unit.id()});
}

bool FarmLedger::grant_one(const WorkerRef& worker, int64_t now, Actions& out) {
  const auto give = [&](const UnitRef& unit) {
    grant(worker, unit, now, out);
    return true;
  };
  const JobId id = worker->job;
  if (worker->leases.size() >= worker->credits || grants_.holds_suspect(*worker)) return false;
  if (worker->leases.empty())
    if (const UnitRef unit = grants_.choose_suspect(*worker, id)) return give(unit);
  if (const UnitRef unit = grants_.choose_second(*worker, id)) return give(unit);
  if (const auto& pending = units_.at(id).pending; !pending.empty()) {
    const UnitRef unit = units_.find(id, pending.begin()->second);
    return grants_.would_end_late(*worker, unit->weight, now) ? false : give(unit);
  }
  if (worker->leases.size() >= worker->traits.threads || !grants_.may_search(id, now)) return false;
  return grant_more(worker, now, out);
}

// Units that others hold.
bool FarmLedger::grant_more(const WorkerRef& worker, int64_t now, Actions& out) {
  const JobId id = worker->job;
  if (const auto [unit, from] = grants_.choose_steal(worker.id(), *worker); unit) {
    if (grants_.would_end_late(*worker, unit->weight, now)) return false;
    grants_.release_of(unit);
    out.push_back(Recall{from, id, unit.id()});
    grant(worker, unit, now, out);
    return true;
  }
  if (const UnitRef unit = grants_.choose_copy(worker.id(), id, now)) {
    if (grants_.would_end_late(*worker, unit->weight, now)) return false;
    units_.mark_copied(unit);
    grants_.note_copy(unit);
    units_.count(id, &JobCounts::copies);
    out.push_back(Note{id, text("unit {} is late: {} gets a copy", unit.id(), worker->traits.name)});
    grant(worker, unit, now, out);
    return true;
  }
  grants_.note_fruitless(id);
  return false;
}

// Whether its job has units for it: the pass is in progress and the worker is to go on with it.
bool FarmLedger::may_serve(const WorkerTable::Worker& worker, int64_t now) const {
  const UnitTable::Job* job = units_.find(worker.job);
  return job && job->open && worker.ready && !job->traits.paused && !worker.leaving &&
         now >= worker.benched_until;
}

void FarmLedger::serve(WorkerId id, int64_t now, Actions& out) {
  const WorkerRef worker = workers_.find(id);
  if (!worker || held_ || worker->presence != Presence::kActive || now < worker->benched_until) return;
  if (worker->job != 0 && !worker->ready) return;  // preparing its scene
  if (may_serve(*worker, now))
    while (grant_one(worker, now, out)) {
    }
  if (!worker->leases.empty()) return;
  if (const JobId next = grants_.pick_job(*worker); next && next != worker->job)
    assign(worker, next, now, out);
  else
    workers_.set_leaving(worker, false);
}

// Grants one unit at a time to the worker with most room, so that the last units spread over all workers. In
// a large farm, where many leave or answer within the same milliseconds, the next tick serves all of them.
void FarmLedger::serve_all(JobId job_id, int64_t now, Actions& out) {
  if (held_) return;
  if (workers_.all().size() > kManyWorkers && now != last_tick_ && now - served_all_at_ < kPauseMs) return;
  served_all_at_ = now;
  std::vector<WorkerRef> able;
  workers_.for_each([&](const WorkerRef& worker) {
    if ((job_id == 0 || worker->job == job_id || worker->job == 0) && worker->presence == Presence::kActive)
      able.push_back(worker);
  });
  bool more = true;
  for (size_t round = 0; more; ++round) {
    more = false;
    for (const WorkerRef& worker : able) {
      const bool served = may_serve(*worker, now);
      if (!served || worker->leases.size() > round) {
        more |= served && worker->leases.size() < worker->credits && round < worker->credits;
        continue;
      }
      more |= grant_one(worker, now, out);
    }
  }
  for (const WorkerRef& worker : able) serve(worker.id(), now, out);
}

void FarmLedger::assign(const WorkerRef& worker, JobId job, int64_t now, Actions& out) {
  workers_.assign(worker, job, now);
  out.push_back(Assign{worker.id(), job});
}

void FarmLedger::wake_users() {
  FairShare& share = workers_.share();
  std::vector<char> runnable(share.size());
  for (const auto& [id, job] : units_.jobs())
    runnable[job.user] |= job.open && !job.traits.paused && (!job.pending.empty() || grants_.count(id) > 0);
  for (UserId user = 0; user < runnable.size(); ++user) runnable[user] ? share.wake(user) : share.sleep(user);
}

// A worker leaves its job when it is another user's turn by more than half a residence of this worker, or
// when the same user has something more urgent. It finishes the units it holds.
void FarmLedger::balance(int64_t now) {
  wake_users();
  workers_.for_each([&](const WorkerRef& worker) {
    if (!worker->ready || worker->leaving || now - worker->assigned_at < rules_.residence_ms) return;
    const UnitTable::Job& job = units_.at(worker->job);
    const JobId next = grants_.pick_job(*worker);
    if (next == 0 || next == worker->job) return;
    const UnitTable::Job& other = units_.at(next);
    const double slack =
        0.5 * static_cast<double>(rules_.residence_ms) * worker->traits.threads / other.weight;
    const bool leaves = other.user == job.user
                            ? other.traits.priority > job.traits.priority
                            : grants_.turn(job, 0) > grants_.turn(other, worker->traits.threads) + slack;
    workers_.set_leaving(worker, leaves);
    if (leaves) workers_.count_for(worker, other.user);
  });
}

}  // namespace kiln
