#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {

FarmLedger::Job* FarmLedger::find_job(JobId job) {
  const auto it = jobs_.find(job);
  return it == jobs_.end() ? nullptr : &it->second;
}

const FarmLedger::Job* FarmLedger::find_job(JobId job) const {
  const auto it = jobs_.find(job);
  return it == jobs_.end() ? nullptr : &it->second;
}

FarmLedger::Unit* FarmLedger::find_unit(Job& job, uint64_t unit) {
  const auto it = job.units.find(unit);
  return it == job.units.end() ? nullptr : &it->second;
}

bool FarmLedger::knows(JobId id, uint64_t unit) const {
  const Job* job = find_job(id);
  return job && job->units.count(unit);
}

void FarmLedger::add_job(JobId id, const JobTraits& traits) {
  KILN_CHECK(id != 0 && !jobs_.count(id));
  Job& job = jobs_[id];
  job.traits = traits;
  job.user = share_.intern(traits.user);
  job.weight = FairShare::weight(traits.priority);
}

void FarmLedger::restore(JobId id, std::span<const KnownAnswer> answers) {
  Job* job = find_job(id);
  KILN_CHECK(job);
  for (const KnownAnswer& known : answers) {
    if (!known.verified && quarantined_for(known.identity))
      continue;  // the machine was quarantined; another must confirm
    Unit& unit = job->units[known.unit];
    unit.shape = known.shape;
    if (known.settled) {
      unit.answers.clear();  // a result ends every dispute
      unit.phase = Phase::kSettled;
      unit.verified = known.verified;
      ++(known.verified ? job->totals.verified : job->totals.unverified);
    } else if (unit.phase == Phase::kSettled) {
      continue;
    }
    const IdentityId who = intern(known.identity);
    if (known.own_voter && identities_[who].voter == kUnknownVoter)
      identities_[who].voter = intern_voter(known.identity);
    unit.answers.push_back({known.digest, {who}, true, 0, {}});
  }
}

void FarmLedger::change_job(JobId id, int32_t priority, bool paused, int64_t now, Actions& out) {
  Job* job = find_job(id);
  if (!job) return;
  job->traits.priority = priority;
  job->weight = FairShare::weight(priority);
  job->traits.paused = paused;
  if (!paused) return serve_all(0, now, out);
  // Running units may finish; those not started are returned.
  for (auto& [worker_id, worker] : workers_) {
    if (worker.job != id) continue;
    while (worker.held.size() > worker.traits.threads) {
      const uint64_t lease = *worker.held.rbegin();
      const uint64_t unit = leases_.at(lease).unit;
      out.push_back(Recall{worker_id, id, unit});
      release(lease);
      if (Unit* u = find_unit(*job, unit)) enqueue(*job, unit, *u);
    }
  }
  serve_all(0, now, out);
}

void FarmLedger::end_job(JobId id, const std::string& reason, int64_t now, Actions& out) {
  Job* job = find_job(id);
  if (!job) return;
  const std::set<uint64_t> leases = job->leases;
  for (uint64_t lease : leases) release(lease);
  KILN_CHECK(job->leases.empty());
  for (auto& [worker_id, worker] : workers_) {
    worker.banned.erase(id);
    worker.classes.erase(id);
    if (worker.job != id) continue;
    unassign(worker, now);
    out.push_back(Release{worker_id, id, reason});
  }
  jobs_.erase(id);
  serve_all(0, now, out);
}

// The queue in which the unit must wait, if any.
void FarmLedger::enqueue(Job& job, uint64_t id, Unit& unit) {
  if (unit.phase != Phase::kOpen || unit.queue != Queue::kNone) return;
  const bool of_pass = job.open && unit.pass == job.pass;
  size_t most = 0;
  for (const Answer& answer : unit.answers) most = std::max(most, votes(answer));
  if (most > 0) {
    // As many other voters as are missing must answer too.
    if (most >= unit.needed || unit.leases.size() + most >= unit.needed) return;
    if (!of_pass && !unit.disputed) return;
    unit.queue = Queue::kSecond;
    job.seconds.insert(id);
  } else if (of_pass && unit.leases.empty()) {
    // It waits for a verdict rather than crash another worker.
    if (unit.unjudged > 0 && unit.failures + unit.unjudged >= rules_.max_attempts) return;
    unit.queue = unit.attempts > 0 ? Queue::kSuspect : Queue::kPending;
    if (unit.attempts > 0)
      job.suspects.insert(id);
    else
      job.pending.insert({unit.order, id});
  }
}

void FarmLedger::dequeue(Job& job, uint64_t id, Unit& unit) {
  size_t left = 1;
  if (unit.queue == Queue::kPending) left = job.pending.erase({unit.order, id});
  if (unit.queue == Queue::kSuspect) left = job.suspects.erase(id);
  if (unit.queue == Queue::kSecond) left = job.seconds.erase(id);
  KILN_CHECK(left == 1);
  unit.queue = Queue::kNone;
}

void FarmLedger::begin_pass(JobId id, std::span<const UnitPlan> units, int64_t now, Actions& out) {
  Job* job = find_job(id);
  KILN_CHECK(job);
  KILN_CHECK(!job->open);
  job->open = true;
  ++job->pass;
  job->order.clear();
  job->counts = {};
  job->counts.number = job->pass;
  job->copied_weight = job->turnaround_ms = job->turnaround_weight = 0;
  for (const UnitPlan& plan : units) {
    KILN_CHECK(plan.id != 0);
    Unit& unit = job->units[plan.id];
    if (unit.shape != plan.shape &&
        !unit.answers.empty()) {  // stored by a release that cut units differently
      for (const Answer& answer : unit.answers) out.push_back(Revoke{id, plan.id, answer.digest});
      dequeue(*job, plan.id, unit);
      if (unit.disputed) --job->disputes;
      if (unit.phase == Phase::kSettled) --(unit.verified ? job->totals.verified : job->totals.unverified);
      const std::vector<uint64_t> leases = unit.leases;
      for (uint64_t lease : leases) release(lease);
      unit = {};
    }
    KILN_CHECK(unit.pass != job->pass);  // ids are unique in a pass
    unit.shape = plan.shape;
    unit.weight = plan.weight;
    unit.pass = job->pass;
    unit.order = static_cast<uint32_t>(job->order.size());
    unit.delivered = false;
    if (unit.phase == Phase::kFailed) unit.phase = Phase::kOpen;
    job->order.push_back(plan.id);
    ++job->counts.units;
    job->counts.weight += plan.weight;
  }
  for (uint64_t unit_id : job->order) {
    Unit& unit = job->units.at(unit_id);
    if (unit.phase == Phase::kSettled) {
      deliver(id, *job, unit_id, unit, out);
    } else if (!unit.answers.empty()) {  // answered before a restart or rewind
      if (unit.answers.size() > 1 && !unit.disputed) dispute(id, *job, unit_id, unit, out);
      unit.needed =
          std::max(unit.needed, needed_votes(id, *job, unit_id, unit.answers.front().voters.front()));
      conclude(id, *job, unit_id, unit, now, out);
    } else {
      enqueue(*job, unit_id, unit);
    }
  }
  complete_if_done(id, *job, out);
  serve_all(0, now, out);
}

void FarmLedger::abandon_pass(JobId id, int64_t now, Actions& out) {
  Job* job = find_job(id);
  if (!job || !job->open) return;
  const std::set<uint64_t> leases = job->leases;
  for (uint64_t lease : leases) {
    out.push_back(Recall{leases_.at(lease).worker, id, leases_.at(lease).unit});
    release(lease);
  }
  for (uint64_t unit : job->order) dequeue(*job, unit, job->units.at(unit));
  job->open = false;
  serve_all(0, now, out);
}

void FarmLedger::deliver(JobId id, Job& job, uint64_t unit_id, Unit& unit, Actions& out) {
  if (!job.open || unit.pass != job.pass) return;
  KILN_CHECK(unit.phase == Phase::kSettled && unit.answers.size() == 1);
  KILN_CHECK(job.counts.done < job.counts.units);
  ++job.counts.done;
  job.counts.weight_done += unit.weight;
  if (unit.delivered) return;  // before a dispute that it won
  unit.delivered = true;
  unit.merged = unit.answers.front().digest;
  out.push_back(Deliver{id, unit_id, unit.answers.front().digest});
}

void FarmLedger::complete_if_done(JobId id, Job& job, Actions& out) {
  if (!job.open || job.disputes > 0 || job.counts.done + job.counts.failed < job.counts.units) return;
  KILN_CHECK(job.counts.done + job.counts.failed == job.counts.units);
  KILN_CHECK(job.pending.empty() && job.suspects.empty());
  job.open = false;
  out.push_back(PassComplete{id});
}

bool FarmLedger::pass_complete(JobId id) const {
  const Job* job = find_job(id);
  return job && !job->open && job->pass > 0;
}

PassCounts FarmLedger::pass(JobId id) const {
  const Job* job = find_job(id);
  return job ? job->counts : PassCounts{};
}

JobCounts FarmLedger::counts(JobId id) const {
  const Job* job = find_job(id);
  if (!job) return {};
  JobCounts counts = job->totals;
  counts.disputes = job->disputes;
  for (const auto& [worker_id, worker] : workers_) {
    if (worker.job != id) continue;
    ++counts.workers;
    counts.threads += worker.traits.threads;
  }
  return counts;
}

const std::string& FarmLedger::numeric_class(JobId id) const {
  static const std::string none;
  const Job* job = find_job(id);
  return job ? job->traits.numeric_class : none;
}

const std::string& FarmLedger::user(JobId id) const {
  static const std::string none;
  const Job* job = find_job(id);
  return job ? job->traits.user : none;
}

// Merged results cannot be subtracted from the sums, so these are rebuilt from the remaining results.
void FarmLedger::rewind(JobId id, Job& job, const std::string& reason, Actions& out) {
  if (job.pass == 0) return;
  job.open = false;
  // Later passes stop until they are requested again: the farm has only the current pass's units, and with
  // other sums the later ones may differ.
  const std::set<uint64_t> leases = job.leases;
  for (uint64_t lease : leases) {
    out.push_back(Recall{leases_.at(lease).worker, id, leases_.at(lease).unit});
    release(lease);
  }
  for (auto& [unit_id, unit] : job.units) {
    dequeue(job, unit_id, unit);
    unit.delivered = unit.disputed = false;
  }
  KILN_CHECK(job.leases.empty());
  job.disputes = 0;
  out.push_back(Rewind{id, reason});
}

int64_t FarmLedger::stuck_ms(JobId id, int64_t now) const {
  const Job* job = find_job(id);
  return job && job->stuck_since >= 0 ? now - job->stuck_since : -1;
}

void FarmLedger::hold(bool on, int64_t now, Actions& out) {
  held_ = on;
  if (!on) serve_all(0, now, out);
}

}  // namespace kiln
