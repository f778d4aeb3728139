#include <algorithm>
#include <map>
#include <set>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {
namespace {

constexpr int64_t kReconnectMs =
    3000;  // a live process has reconnected by then, unless the network is down for longer

}  // namespace

size_t FarmLedger::held(WorkerId id) const {
  const WorkerTable::Worker* worker = workers_.find(id);
  return worker ? worker->leases.size() : 0;
}

bool FarmLedger::is_banned(WorkerId id, JobId job) const {
  const WorkerTable::Worker* worker = workers_.find(id);
  return worker && worker->banned.count(job) > 0;
}

void FarmLedger::join(WorkerId id, const WorkerTraits& traits, int64_t now, Actions& out) {
  now = time_.advance(now);
  const IdentityId identity = trust_.intern(traits.identity);
  const bool unknown = trust_.at(identity).voter == TrustTable::kUnknownVoter;
  trust_.set_voter(identity, traits.voter.empty() ? traits.identity : traits.voter);
  const WorkerRef worker = workers_.add(id, traits, identity, now);
  units_.forgive_losses(traits.process);
  if (const std::string* reason = quarantined_for(traits.identity)) {
    workers_.set_presence(worker, Presence::kDraining);
    out.push_back(Expel{id, *reason});
    return;
  }
  out.push_back(Note{0, text("{} joined with {} threads", traits.name, worker->traits.threads)});
  if (unknown) count_again(identity, now, out);
  serve(id, now, out);
}

void FarmLedger::prove(WorkerId id, JobId job, const std::string& numeric_class) {
  if (const WorkerRef worker = workers_.find(id); worker && has_job(job))
    workers_.prove(worker, job, numeric_class);
}

WorkerView FarmLedger::view(WorkerId id, int64_t now) const {
  now = time_.at(now);
  WorkerView view;
  const WorkerTable::Worker* worker = workers_.find(id);
  if (!worker) return view;
  view.job = worker->job;
  view.held = static_cast<uint32_t>(worker->leases.size());
  view.credits = worker->credits;
  view.agreed = trust_.at(worker->identity).agreed;
  view.state = worker->presence == Presence::kSilent     ? "silent"
               : worker->presence == Presence::kDraining ? "leaving"
               : now < worker->benched_until             ? "benched"
               : worker->job != 0 && !worker->ready      ? "preparing"
               : worker->leases.empty()                  ? "idle"
                                                         : "baking";
  return view;
}

void FarmLedger::ready(WorkerId id, JobId job_id, const std::string& numeric_class, uint32_t credits,
                       std::span<const uint64_t> held, int64_t now, Actions& out) {
  now = time_.advance(now);
  const WorkerRef worker = workers_.find(id);
  if (!worker) return;
  hear(id, now, out);
  const UnitTable::Job* job = units_.find(job_id);
  if (!job) return;
  // It may already have the job from before its connection broke.
  if (worker->job == 0 && worker->presence == Presence::kActive && !worker->banned.count(job_id))
    workers_.assign(worker, job_id, now);
  if (worker->job != job_id) return;  // assigned to another job meanwhile
  workers_.prove(worker, job_id, numeric_class);
  if (job->traits.numeric_class.empty()) {
    units_.pin_class(job_id, numeric_class);
    out.push_back(PinClass{job_id, numeric_class});
  }
  if (job->traits.numeric_class != numeric_class) {
    const std::string reason = text(
        "numeric class {} differs from the job's {}: its results would differ in the last bits; give this "
        "job "
        "workers with the same processor features, or choose kernels that all of them have with --isa",
        numeric_class, job->traits.numeric_class);
    workers_.ban(worker, job_id, reason);
    workers_.note_other_class(job_id, id, numeric_class);
    revoke_all(worker);  // it may have had the right class before
    workers_.unassign(worker, now);
    out.push_back(Note{job_id, text("{} is not used: {}", worker->traits.name, reason)});
    out.push_back(Release{id, job_id, reason});
    return serve(id, now, out);
  }
  workers_.make_ready(worker, credits, now);
  // Units from an earlier coordinator, or from before the connection broke: it continues them.
  for (const uint64_t unit_id : held) {
    const UnitRef unit = units_.find(job_id, unit_id);
    const bool wanted = worker->leases.size() < credits && unit && unit->queue != Queue::kNone &&
                        !units_.voted(*unit, worker->identity);
    if (wanted) {
      grant(worker, unit, now, out);
      out.pop_back();  // it has it already: no need to send it
    }
  }
  serve(id, now, out);
}

void FarmLedger::job_refused(WorkerId id, JobId job_id, const Error& error, int64_t now, Actions& out) {
  now = time_.advance(now);
  const WorkerRef worker = workers_.find(id);
  if (!worker) return;
  hear(id, now, out);
  if (!has_job(job_id)) return;  // it has ended, or never was
  workers_.ban(worker, job_id, error.message);
  out.push_back(Note{job_id, text("{} cannot bake this job: {}", worker->traits.name, error.message)});
  if (worker->job == job_id) {
    revoke_all(worker);
    workers_.unassign(worker, now);
    if (error.kind == ErrorKind::kInvalidInput) out.push_back(FailJob{job_id, error});  // any worker would
  }
  serve_all(0, now, out);
}

void FarmLedger::heard(WorkerId id, int64_t now, Actions& out) {
  hear(id, time_.advance(now), out);
}

void FarmLedger::hear(WorkerId id, int64_t now, Actions& out) {
  const WorkerRef worker = workers_.find(id);
  if (!worker) return;
  workers_.hear(worker, now);
  if (worker->presence != Presence::kSilent) return;
  workers_.set_presence(worker, Presence::kActive);
  out.push_back(Note{0, text("{} is back", worker->traits.name)});
  serve(id, now, out);
}

void FarmLedger::revoke_all(const WorkerRef& worker) {
  while (!worker->leases.empty()) {
    const uint64_t lease = *worker->leases.all().begin();
    const UnitRef unit = grants_.at(lease).unit;
    grants_.release(lease);
    units_.count(unit.job_id(), &JobCounts::reassigned);
    units_.enqueue(unit);
  }
}

// A unit alone on the worker is to blame; otherwise all its units are suspects and will run alone. The
// verdict waits for a lease, because the process may be alive behind a broken network.
void FarmLedger::lose_units(const WorkerRef& worker, const std::string& reason, int64_t now) {
  units_.count(worker->job, &JobCounts::lost);
  const bool certain = worker->leases.size() == 1;
  while (!worker->leases.empty()) {
    const uint64_t lease = *worker->leases.all().begin();
    const UnitRef unit = grants_.at(lease).unit;
    grants_.release(lease);
    units_.count(unit.job_id(), &JobCounts::reassigned);
    units_.note_loss(unit, {worker->traits.process, worker->identity, now, certain, unit.job_id(), unit.id(),
                            text("{} was lost ({})", worker->traits.name, reason)});
    units_.enqueue(unit);
  }
}

void FarmLedger::leave(WorkerId id, bool crashed, const std::string& reason, int64_t now, Actions& out) {
  now = time_.advance(now);
  const WorkerRef worker = workers_.find(id);
  if (!worker) return;
  workers_.charge(worker, now);
  out.push_back(Note{worker->job, text("{} {}: {}; {} units go back", worker->traits.name,
                                       crashed ? "was lost" : "left", reason, worker->leases.size())});
  if (crashed && has_job(worker->job)) lose_units(worker, reason, now);
  revoke_all(worker);
  workers_.unassign(worker, now);
  workers_.remove(worker);
  serve_all(0, now, out);
}

void FarmLedger::drain(WorkerId id, std::span<const uint64_t> unbegun, int64_t now, Actions& out) {
  now = time_.advance(now);
  const WorkerRef worker = workers_.find(id);
  if (!worker) return;
  workers_.set_presence(worker, Presence::kDraining);
  workers_.hear(worker, now);
  out.push_back(Note{worker->job,
                     text("{} finishes its units and hands {} back", worker->traits.name, unbegun.size())});
  const std::set<uint64_t> held = worker->leases.all();
  for (const uint64_t lease : held) {
    const UnitRef unit = grants_.at(lease).unit;
    if (std::find(unbegun.begin(), unbegun.end(), unit.id()) == unbegun.end()) continue;
    grants_.release(lease);
    units_.enqueue(unit);
  }
  serve_all(0, now, out);
}

void FarmLedger::judge_losses(int64_t now, Actions& out) {
  units_.judge_losses(
      now, std::min(rules_.lease_ms, kReconnectMs), [&](const UnitRef& unit, const std::string& reason) {
        give_up(
            unit,
            text("unit {} failed {} times, the last time because {}", unit.id(), unit->failures(), reason),
            out);
      });
}

void FarmLedger::find_silent(int64_t now, Actions& out) {
  workers_.for_each([&](const WorkerRef& worker) {
    const bool known = worker->presence == Presence::kSilent ||
                       (worker->presence == Presence::kDraining && worker->leases.empty());
    if (known || now - worker->last_heard <= rules_.lease_ms) return;
    out.push_back(
        Note{worker->job, text("{} has been silent for {} ms; its {} units go to others", worker->traits.name,
                               now - worker->last_heard, worker->leases.size())});
    if (worker->presence == Presence::kActive) workers_.set_presence(worker, Presence::kSilent);
    workers_.charge(worker, now);
    grants_.haunt(worker);
    revoke_all(worker);
  });
}

void FarmLedger::find_unready(const WorkerRef& worker, int64_t now, Actions& out) {
  if (worker->job == 0 || worker->ready || now - worker->assigned_at <= rules_.hang_ms) return;
  const std::string reason = text("its scene was not ready after {} s", (now - worker->assigned_at) / 1000);
  out.push_back(Note{worker->job, text("{} is not used: {}", worker->traits.name, reason)});
  out.push_back(Release{worker.id(), worker->job, reason});
  // Not forever: a slow link or disk may have recovered.
  workers_.bench(worker, now + (rules_.hang_ms << std::min(worker->benched, 6u)));
  workers_.unassign(worker, now);
}

// It sends heartbeats, but a unit that others finish in a fraction of the time does not end.
void FarmLedger::find_hung(const WorkerRef& worker, int64_t now, Actions& out) {
  if (worker->leases.empty()) return;
  const uint64_t oldest = *worker->leases.all().begin();
  const UnitRef unit = grants_.at(oldest).unit;
  const double limit =
      std::max(static_cast<double>(rules_.hang_ms), 100 * grants_.usual_ms(unit.job_id(), unit->weight));
  if (static_cast<double>(now - grants_.at(oldest).since) <= limit) return;
  workers_.set_presence(worker, Presence::kDraining);
  const std::string reason =
      text("unit {} of job {} has not ended within {:.0f} s: the worker hangs, start it anew", unit.id(),
           unit.job_id(), limit / 1000);
  grants_.release(oldest);
  blame(unit, worker, worker->leases.ghosts() == 0, text("{} hung", worker->traits.name), out);
  units_.enqueue(unit);
  out.push_back(Expel{worker.id(), reason});
}

// Verification needs a second voter. Without one the job continues unverified and reports it; with a quorum
// set by the user it waits.
void FarmLedger::waive_audits(int64_t now, Actions& out) {
  if (rules_.audit_first == 0) return;
  for (const auto& [id, job] : units_.jobs()) {
    if (job.traits.quorum > 1 || !job.open) continue;
    std::set<VoterId> able;
    for (const auto& [worker_id, worker] : workers_.all())
      if (worker.presence == Presence::kActive && WorkerTable::may_work(id, job, worker))
        able.insert(trust_.at(worker.identity).voter);
    if (able.size() != 1) {
      workers_.set_alone(id, -1, false);
      continue;
    }
    const int64_t since = workers_.lack(id).alone_since < 0 ? now : workers_.lack(id).alone_since;
    workers_.set_alone(id, since, now - since > rules_.lease_ms);
    if (!workers_.lack(id).alone) continue;
    const std::set<uint64_t> seconds = job.seconds;
    for (const uint64_t unit_id : seconds) {
      const UnitRef unit = units_.find(id, unit_id);
      if (unit->disputed || unit->needed <= 1) continue;
      units_.require(unit, 1);
      units_.count(id, &JobCounts::waived);
      conclude(unit, now, out);
    }
  }
}

// The job takes the first worker's class. If machines of that class are gone, or too few to decide, while
// machines of other classes wait, the job starts over with the class that most of them have: results of two
// classes are never mixed.
void FarmLedger::find_stuck(int64_t now, Actions& out) {
  for (const auto& entry : units_.jobs()) {
    const JobId id = entry.first;
    const UnitTable::Job& job = entry.second;
    const bool could_go_on = std::any_of(workers_.all().begin(), workers_.all().end(), [&](const auto& w) {
      return w.second.presence == Presence::kActive && WorkerTable::may_work(id, job, w.second) &&
             grants_.has_work(id, job, w.second);
    });
    if (!job.open || job.traits.paused || grants_.count(id) > 0 || could_go_on) {
      workers_.set_stuck(id, -1);
      continue;
    }
    const int64_t since = workers_.lack(id).stuck_since < 0 ? now : workers_.lack(id).stuck_since;
    workers_.set_stuck(id, since);
    if (now - since <= rules_.class_patience_ms) continue;
    if (const std::string better = better_class(id); !better.empty()) change_class(id, better, now, out);
  }
}

std::string FarmLedger::better_class(JobId id) const {
  std::map<std::string, std::set<IdentityId>> by_class;
  for (const auto& [worker_id, its_class] : workers_.lack(id).other_class) {
    const WorkerTable::Worker* worker = workers_.find(worker_id);
    if (worker && worker->presence == Presence::kActive) by_class[its_class].insert(worker->identity);
  }
  size_t able = 0, most = 0;
  std::string better;
  for (const auto& [worker_id, worker] : workers_.all())
    able += worker.presence == Presence::kActive && WorkerTable::may_work(id, units_.at(id), worker);
  for (const auto& [its_class, identities] : by_class)
    if (identities.size() > std::max(most, able)) most = identities.size(), better = its_class;
  return better;
}

void FarmLedger::change_class(JobId id, const std::string& better, int64_t now, Actions& out) {
  const std::string reason =
      text("no worker of numeric class {} could go on for {} s: the job starts over with {}",
           numeric_class(id), rules_.class_patience_ms / 1000, better);
  for (const auto& [worker_id, its_class] : workers_.lack(id).other_class) workers_.lift_ban(worker_id, id);
  workers_.clear_other_class(id);
  workers_.for_each([&](const WorkerRef& worker) {
    const auto its_class = worker->classes.find(id);
    if (its_class == worker->classes.end() || its_class->second == better) return;
    workers_.ban(worker, id, reason);
    workers_.note_other_class(id, worker.id(), its_class->second);
    if (worker->job != id) return;
    workers_.unassign(worker, now);
    out.push_back(Release{worker.id(), id, reason});
  });
  units_.start_over(id, better, out);
  out.push_back(PinClass{id, better});
  rewind(id, reason, out);
}

void FarmLedger::tick(int64_t now, Actions& out) {
  now = time_.advance(now);
  last_tick_ = now;
  find_silent(now, out);
  workers_.for_each([&](const WorkerRef& worker) {
    if (worker->presence != Presence::kActive) return;
    find_unready(worker, now, out);
    find_hung(worker, now, out);
  });
  judge_losses(now, out);
  waive_audits(now, out);
  find_stuck(now, out);
  workers_.for_each([&](const WorkerRef& worker) { workers_.charge(worker, now); });
  grants_.find_spare(now);
  balance(now);
  serve_all(0, now, out);
}

}  // namespace kiln
