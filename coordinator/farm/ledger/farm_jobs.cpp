#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {

bool FarmLedger::knows(JobId id, uint64_t unit) const {
  const UnitTable::Job* job = units_.find(id);
  return job && job->units.count(unit);
}

void FarmLedger::add_job(JobId id, const JobTraits& traits) {
  units_.add_job(id, traits, workers_.share().intern(traits.user));
  grants_.add_job(id);
}

void FarmLedger::restore(JobId id, std::span<const KnownAnswer> answers) {
  for (const KnownAnswer& known : answers) {
    if (!known.verified && quarantined_for(known.identity))
      continue;  // the machine was quarantined; another must confirm
    const IdentityId who = trust_.intern(known.identity);
    if (known.own_voter) trust_.presume_own_voter(who);
    units_.restore(id, known, who);
  }
}

void FarmLedger::change_job(JobId id, int32_t priority, bool paused, int64_t now, Actions& out) {
  now = time_.advance(now);
  if (!units_.find(id)) return;
  units_.change_job(id, priority, paused);
  if (!paused) return serve_all(0, now, out);
  // Running units may finish; those not started are returned.
  workers_.for_each([&](const WorkerRef& worker) {
    if (worker->job != id) return;
    while (worker->leases.size() > worker->traits.threads) {
      const uint64_t lease = *worker->leases.all().rbegin();
      const UnitRef unit = grants_.at(lease).unit;
      out.push_back(Recall{worker.id(), id, unit.id()});
      grants_.release(lease);
      units_.enqueue(unit);
    }
  });
  serve_all(0, now, out);
}

void FarmLedger::end_job(JobId id, const std::string& reason, int64_t now, Actions& out) {
  now = time_.advance(now);
  if (!units_.find(id)) return;
  grants_.release_all(id);
  workers_.for_each([&](const WorkerRef& worker) {
    if (worker->job != id) return;
    workers_.unassign(worker, now);
    out.push_back(Release{worker.id(), id, reason});
  });
  workers_.forget_job(id);
  grants_.end_job(id);
  units_.end_job(id);
  serve_all(0, now, out);
}

void FarmLedger::begin_pass(JobId id, std::span<const UnitPlan> plans, int64_t now, Actions& out) {
  now = time_.advance(now);
  units_.open_pass(id);
  grants_.begin_pass(id);
  for (const UnitPlan& plan : plans) {
    const UnitRef unit = units_.find_or_add(id, plan.id);
    if (unit->shape != plan.shape &&
        !unit->answers.empty()) {  // stored by a release that cut units differently
      for (const Answer& answer : unit->answers) out.push_back(Revoke{id, plan.id, answer.digest});
      grants_.release_of(unit);
      units_.forget(unit);
    }
    units_.place(unit, plan);
  }
  for (const uint64_t unit_id : units_.at(id).order) {
    const UnitRef unit = units_.find(id, unit_id);
    if (unit->phase == Phase::kSettled) {
      units_.deliver(unit, out);
    } else if (!unit->answers.empty()) {  // answered before a restart or rewind
      if (unit->answers.size() > 1 && !unit->disputed) dispute(unit, out);
      units_.require(unit, std::max(unit->needed, needed_votes(unit, unit->answers.front().voters.front())));
      conclude(unit, now, out);
    } else {
      units_.enqueue(unit);
    }
  }
  units_.complete_if_done(id, out);
  serve_all(0, now, out);
}

void FarmLedger::abandon_pass(JobId id, int64_t now, Actions& out) {
  now = time_.advance(now);
  const UnitTable::Job* job = units_.find(id);
  if (!job || !job->open) return;
  grants_.recall_all(id, out);
  units_.abandon_pass(id);
  serve_all(0, now, out);
}

bool FarmLedger::pass_complete(JobId id) const {
  const UnitTable::Job* job = units_.find(id);
  return job && !job->open && job->pass > 0;
}

PassCounts FarmLedger::pass(JobId id) const {
  const UnitTable::Job* job = units_.find(id);
  return job ? job->counts : PassCounts{};
}

JobCounts FarmLedger::counts(JobId id) const {
  const UnitTable::Job* job = units_.find(id);
  if (!job) return {};
  JobCounts counts = job->totals;
  counts.disputes = job->disputes;
  for (const auto& [worker_id, worker] : workers_.all()) {
    if (worker.job != id) continue;
    ++counts.workers;
    counts.threads += worker.traits.threads;
  }
  return counts;
}

const std::string& FarmLedger::numeric_class(JobId id) const {
  static const std::string none;
  const UnitTable::Job* job = units_.find(id);
  return job ? job->traits.numeric_class : none;
}

const std::string& FarmLedger::user(JobId id) const {
  static const std::string none;
  const UnitTable::Job* job = units_.find(id);
  return job ? job->traits.user : none;
}

// Merged results cannot be subtracted from the sums, so these are rebuilt from the remaining results.
void FarmLedger::rewind(JobId id, const std::string& reason, Actions& out) {
  if (units_.at(id).pass == 0) return;
  units_.close_pass(id);
  // Later passes stop until they are requested again: the farm has only the current pass's units, and with
  // other sums the later ones may differ.
  grants_.recall_all(id, out);
  units_.reset_passes(id);
  out.push_back(Rewind{id, reason});
}

int64_t FarmLedger::stuck_ms(JobId id, int64_t now) const {
  now = time_.at(now);
  const int64_t since = workers_.lack(id).stuck_since;
  return since >= 0 ? now - since : -1;
}

void FarmLedger::hold(bool on, int64_t now, Actions& out) {
  now = time_.advance(now);
  held_ = on;
  if (!on) serve_all(0, now, out);
}

}  // namespace kiln
