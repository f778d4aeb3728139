// Grants units within a job, in this order: a unit that cost a worker, alone on a worker that holds nothing;
// a unit that needs a second answer; the next unit in order; for an idle thread, a unit that another worker
// has not started; and last a copy of a late unit.
#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {
namespace {

constexpr int64_t kSpeedMs = 20;
constexpr size_t kManyWorkers = 256;  // above this, full searches are limited to this rate
constexpr int64_t kPauseMs = 10;
constexpr uint32_t kSearches =
    64;  // fruitless searches of a job in that time: more than have answered any one unit

}  // namespace

bool FarmLedger::holds_suspect(const Worker& worker) const {
  if (const Job* job = find_job(worker.job); !job || !job->suspected) return false;
  return std::any_of(worker.held.begin(), worker.held.end(), [&](uint64_t number) {
    const Lease& lease = leases_.at(number);
    const Unit& unit = jobs_.at(lease.job).units.at(lease.unit);
    return unit.attempts > 0 && unit.phase == Phase::kOpen;
  });
}

// A suspect that this identity has not failed; one that every able worker has failed may go to any.
uint64_t FarmLedger::choose_suspect(const Worker& worker, const Job& job) const {
  for (const uint64_t id : job.suspects) {
    const std::vector<IdentityId>& blamed = job.units.at(id).blamed;
    const auto failed = [&](const Worker& w) {
      return std::find(blamed.begin(), blamed.end(), w.identity) != blamed.end();
    };
    if (!failed(worker)) return id;
    const bool all_failed = std::all_of(workers_.begin(), workers_.end(), [&](const auto& entry) {
      return entry.second.presence != Presence::kActive || failed(entry.second) ||
             entry.second.banned.count(worker.job);
    });
    if (all_failed) return id;
  }
  return 0;
}

uint64_t FarmLedger::choose_second(const Worker& worker, const Job& job) const {
  const auto leased = [&](const Unit& unit) {
    return std::any_of(unit.leases.begin(), unit.leases.end(), [&](uint64_t lease) {
      return same_voter(workers_.at(leases_.at(lease).worker).identity, worker.identity);
    });
  };
  for (const uint64_t id : job.seconds) {
    const Unit& unit = job.units.at(id);
    if (!voted(unit, worker.identity) && !leased(unit)) return id;
  }
  return 0;
}

// The newest unit not yet started by the worker with the longest queue.
uint64_t FarmLedger::choose_steal(WorkerId id, const Worker& worker, Job& job, WorkerId& from) {
  for (auto it = job.backlogs.rbegin(); it != job.backlogs.rend(); ++it) {
    if (it->second == id) continue;
    const Lease& newest = leases_.at(*workers_.at(it->second).held.rbegin());
    const Unit& unit = job.units.at(newest.unit);
    if (unit.leases.size() > 1 || unit.attempts > 0 || voted(unit, worker.identity)) continue;
    from = it->second;
    return newest.unit;
  }
  return 0;
}

// The oldest lease that has taken twice the usual time for its work, of a unit with no other holder; once per
// unit and at most a share of the pass (Dean & Barroso, "The Tail at Scale", 2013: hedged requests).
uint64_t FarmLedger::choose_copy(WorkerId id, const Job& job, int64_t now) const {
  const double per_weight = job.turnaround_weight > 0 ? job.turnaround_ms / job.turnaround_weight : 0;
  for (const uint64_t number : job.leases) {
    const Lease& lease = leases_.at(number);
    const Unit& unit = job.units.at(lease.unit);
    const double usual = per_weight > 0 ? per_weight * unit.weight : static_cast<double>(rules_.lease_ms) / 2;
    const double age = static_cast<double>(now - lease.since);
    if (age <= 2 * usual) continue;
    const bool within_share = job.copied_weight + unit.weight <=
                              std::max(rules_.speculative_share * job.counts.weight, unit.weight);
    if (!within_share && age <= 10 * usual) continue;
    const bool mine = lease.worker == id || (id != 0 && voted(unit, workers_.at(id).identity));
    if (mine || unit.phase != Phase::kOpen || unit.copied || unit.attempts > 0 || unit.leases.size() > 1)
      continue;
    return lease.unit;
  }
  return 0;
}

// Speed of all its workers together and of the fastest. Cached briefly, because every grant needs it and
// rates average many results.
void FarmLedger::reckon_speed(JobId id, const Job& job, int64_t now) const {
  job.speed = {now, 0, 0};
  for (const auto& [worker_id, worker] : workers_) {
    if (worker.job != id || !worker.ready || worker.presence != Presence::kActive || worker.rate <= 0)
      continue;
    const double ms = worker.traits.threads / worker.rate;
    if (job.speed.rate <= 0 || ms < job.speed.least_ms) job.speed.least_ms = ms;
    job.speed.rate += worker.rate;
  }
}

// A machine ten times slower would make all others wait for its last unit: it gets none that the others would
// finish sooner.
bool FarmLedger::would_end_late(const Worker& worker, const Job& job, double weight, int64_t now) const {
  if (worker.rate <= 0) return false;
  if (job.speed.when < 0 || now - job.speed.when >= kSpeedMs) reckon_speed(worker.job, job, now);
  if (job.speed.rate <= 0) return false;
  const double best = 2 * weight * job.speed.least_ms;  // one running, one waiting
  const double rest = (job.counts.weight - job.counts.weight_done) / job.speed.rate;
  const double mine = std::max(weight * worker.traits.threads, worker.held_weight + weight) / worker.rate;
  return mine > 1.3 * std::max(rest, best);
}

void FarmLedger::grant(WorkerId id, Worker& worker, Job& job, uint64_t unit_id, int64_t now, Actions& out) {
  Unit& unit = job.units.at(unit_id);
  if (unit.queue != Queue::kSecond) dequeue(job, unit_id, unit);
  if (worker.held.empty()) worker.busy_since = worker.charged_until = now;
  KILN_CHECK(worker.held.size() < worker.credits && worker.job != 0);
  KILN_CHECK(unit.phase == Phase::kOpen && lease_of(id, unit) == 0);
  const uint64_t lease = next_lease_++;
  leases_.emplace(lease, Lease{id, worker.job, unit_id, now});
  worker.held.insert(lease);
  note_backlog(job, id, worker, worker.held.size() - 1);
  worker.held_weight += unit.weight;
  unit.leases.push_back(lease);
  job.leases.insert(lease);
  if (unit.queue == Queue::kSecond) {  // enough workers are asked now, or one more is needed
    dequeue(job, unit_id, unit);
    enqueue(job, unit_id, unit);
  }
  out.push_back(Grant{id, worker.job, lease, unit_id});
}

bool FarmLedger::grant_one(WorkerId id, Worker& worker, Job& job, int64_t now, Actions& out) {
  if (worker.held.size() >= worker.credits || holds_suspect(worker)) return false;
  if (worker.held.empty())
    if (const uint64_t unit = choose_suspect(worker, job))
      return grant(id, worker, job, unit, now, out), true;
  if (const uint64_t unit = choose_second(worker, job)) return grant(id, worker, job, unit, now, out), true;
  if (!job.pending.empty()) {
    const uint64_t unit = job.pending.begin()->second;
    if (would_end_late(worker, job, job.units.at(unit).weight, now)) return false;
    return grant(id, worker, job, unit, now, out), true;
  }
  if (worker.held.size() >= worker.traits.threads) return false;
  if (now - job.searched_at >= kPauseMs) job.searched_at = now, job.searches = 0;
  if (workers_.size() > kManyWorkers && job.searches >= kSearches) return false;
  WorkerId from = 0;
  if (const uint64_t unit = choose_steal(id, worker, job, from)) {
    if (would_end_late(worker, job, job.units.at(unit).weight, now)) return false;
    const uint64_t lease = job.units.at(unit).leases.front();
    release(lease);
    out.push_back(Recall{from, worker.job, unit});
    return grant(id, worker, job, unit, now, out), true;
  }
  if (const uint64_t unit = choose_copy(id, job, now)) {
    Unit& copied = job.units.at(unit);
    if (would_end_late(worker, job, copied.weight, now)) return false;
    copied.copied = true;
    job.copied_weight += copied.weight;
    ++job.totals.copies;
    out.push_back(Note{worker.job, text("unit {} is late: {} gets a copy", unit, worker.traits.name)});
    return grant(id, worker, job, unit, now, out), true;
  }
  ++job.searches;
  return false;
}

void FarmLedger::serve(WorkerId id, int64_t now, Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker || held_ || worker->presence != Presence::kActive || now < worker->benched_until) return;
  if (worker->job != 0 && !worker->ready) return;  // preparing its scene
  Job* job = find_job(worker->job);
  if (job && job->open && !job->traits.paused && !worker->leaving)
    while (grant_one(id, *worker, *job, now, out)) {
    }
  if (!worker->held.empty()) return;
  if (const JobId next = pick_job(*worker); next && next != worker->job)
    assign(id, *worker, next, now, out);
  else
    worker->leaving = false;
}

// Grants one unit at a time to the worker with most room, so that the last units spread over all workers. In
// a large farm, where many leave or answer within the same milliseconds, the next tick serves all of them.
void FarmLedger::serve_all(JobId job_id, int64_t now, Actions& out) {
  if (held_) return;
  if (workers_.size() > kManyWorkers && now != last_tick_ && now - served_all_at_ < kPauseMs) return;
  served_all_at_ = now;
  std::vector<WorkerId> able;
  for (auto& [id, worker] : workers_)
    if ((job_id == 0 || worker.job == job_id || worker.job == 0) && worker.presence == Presence::kActive)
      able.push_back(id);
  bool more = true;
  for (size_t round = 0; more; ++round) {
    more = false;
    for (const WorkerId id : able) {
      Worker& worker = workers_.at(id);
      Job* job = find_job(worker.job);
      const bool served = job && job->open && worker.ready && !job->traits.paused && !worker.leaving &&
                          now >= worker.benched_until;
      if (!served || worker.held.size() > round) {
        more |= served && worker.held.size() < worker.credits && round < worker.credits;
        continue;
      }
      more |= grant_one(id, worker, *job, now, out);
    }
  }
  for (const WorkerId id : able) serve(id, now, out);
}

}  // namespace kiln
