#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {
namespace {

constexpr int64_t kReconnectMs =
    3000;  // a live process has reconnected by then, unless the network is down for longer

}  // namespace

FarmLedger::Worker* FarmLedger::find_worker(WorkerId worker) {
  const auto it = workers_.find(worker);
  return it == workers_.end() ? nullptr : &it->second;
}

size_t FarmLedger::held(WorkerId worker) const {
  const auto it = workers_.find(worker);
  return it == workers_.end() ? 0 : it->second.held.size();
}

bool FarmLedger::is_banned(WorkerId worker, JobId job) const {
  const auto it = workers_.find(worker);
  return it != workers_.end() && it->second.banned.count(job) > 0;
}

uint32_t FarmLedger::present() const {
  return static_cast<uint32_t>(std::count_if(workers_.begin(), workers_.end(), [](const auto& w) {
    return w.second.presence == Presence::kActive;
  }));
}

void FarmLedger::join(WorkerId id, const WorkerTraits& traits, int64_t now, Actions& out) {
  KILN_CHECK(!workers_.count(id));
  Worker& worker = workers_[id];
  worker.traits = traits;
  worker.traits.threads = std::max(1u, traits.threads);
  worker.identity = intern(traits.identity);
  const bool unknown = identities_[worker.identity].voter == kUnknownVoter;
  identities_[worker.identity].voter = intern_voter(traits.voter.empty() ? traits.identity : traits.voter);
  worker.last_heard = worker.charged_until = now;
  forgive_losses(traits.process);
  if (const std::string* reason = quarantined_for(traits.identity)) {
    worker.presence = Presence::kDraining;
    out.push_back(Expel{id, *reason});
    return;
  }
  out.push_back(Note{0, text("{} joined with {} threads", traits.name, worker.traits.threads)});
  if (unknown) count_again(worker.identity, now, out);
  serve(id, now, out);
}

void FarmLedger::prove(WorkerId id, JobId job, const std::string& numeric_class) {
  if (Worker* worker = find_worker(id); worker && find_job(job)) worker->classes[job] = numeric_class;
}

WorkerView FarmLedger::view(WorkerId id, int64_t now) const {
  WorkerView view;
  const auto it = workers_.find(id);
  if (it == workers_.end()) return view;
  const Worker& worker = it->second;
  view.job = worker.job;
  view.held = static_cast<uint32_t>(worker.held.size());
  view.credits = worker.credits;
  view.agreed = identities_[worker.identity].agreed;
  view.state = worker.presence == Presence::kSilent     ? "silent"
               : worker.presence == Presence::kDraining ? "leaving"
               : now < worker.benched_until             ? "benched"
               : worker.job != 0 && !worker.ready       ? "preparing"
               : worker.held.empty()                    ? "idle"
                                                        : "baking";
  return view;
}

void FarmLedger::ready(WorkerId id, JobId job_id, const std::string& numeric_class, uint32_t credits,
                       std::span<const uint64_t> held, int64_t now, Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker) return;
  heard(id, now, out);
  Job* job = find_job(job_id);
  if (!job) return;
  if (worker->job == 0 && worker->presence == Presence::kActive && !worker->banned.count(job_id)) {
    // It already has the job from before its connection broke.
    assign(id, *worker, job_id, now, out);
    out.pop_back();
  }
  if (worker->job != job_id) return;  // assigned to another job meanwhile
  prove(id, job_id, numeric_class);
  if (job->traits.numeric_class.empty()) {
    job->traits.numeric_class = numeric_class;
    out.push_back(PinClass{job_id, numeric_class});
  }
  if (job->traits.numeric_class != numeric_class) {
    const std::string reason = text(
        "numeric class {} differs from the job's {}: its results would differ in the last bits; give this "
        "job "
        "workers with the same processor features, or choose kernels that all of them have with --isa",
        numeric_class, job->traits.numeric_class);
    worker->banned[job_id] = reason;
    job->other_class[id] = numeric_class;
    unassign(*worker, now);
    out.push_back(Note{job_id, text("{} is not used: {}", worker->traits.name, reason)});
    out.push_back(Release{id, job_id, reason});
    return serve(id, now, out);
  }
  worker->ready = true;
  worker->credits = credits;
  worker->assigned_at = worker->charged_until = now;
  // Units from an earlier coordinator, or from before the connection broke: it continues them.
  for (const uint64_t unit_id : held) {
    Unit* unit = find_unit(*job, unit_id);
    const bool wanted = worker->held.size() < credits && unit && unit->queue != Queue::kNone &&
                        !voted(*unit, worker->identity);
    if (wanted) {
      grant(id, *worker, *job, unit_id, now, out);
      out.pop_back();  // it has it already: no need to send it
    }
  }
  serve(id, now, out);
}

void FarmLedger::job_refused(WorkerId id, JobId job_id, const Error& error, int64_t now, Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker) return;
  heard(id, now, out);
  Job* job = find_job(job_id);
  worker->banned[job_id] = error.message;
  out.push_back(Note{job_id, text("{} cannot bake this job: {}", worker->traits.name, error.message)});
  if (job && worker->job == job_id) {
    revoke_all(*worker);
    unassign(*worker, now);
    if (error.kind == ErrorKind::kInvalidInput) out.push_back(FailJob{job_id, error});  // any worker would
  }
  serve_all(0, now, out);
}

void FarmLedger::heard(WorkerId id, int64_t now, Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker) return;
  worker->last_heard = now;
  if (worker->presence != Presence::kSilent) return;
  worker->presence = Presence::kActive;
  out.push_back(Note{0, text("{} is back", worker->traits.name)});
  serve(id, now, out);
}

void FarmLedger::release(uint64_t lease) {
  const auto it = leases_.find(lease);
  if (it == leases_.end()) return;
  Job& job = jobs_.at(it->second.job);
  Unit& unit = job.units.at(it->second.unit);
  Worker& worker = workers_.at(it->second.worker);
  const size_t before = worker.held.size();
  KILN_CHECK(worker.held.erase(lease) == 1);
  note_backlog(job, it->second.worker, worker, before);
  worker.held_weight = worker.held.empty() ? 0 : worker.held_weight - unit.weight;
  KILN_CHECK(std::erase(unit.leases, lease) == 1);
  KILN_CHECK(job.leases.erase(lease) == 1);
  leases_.erase(it);
}

void FarmLedger::note_backlog(Job& job, WorkerId id, const Worker& worker, size_t held_before) {
  const size_t threads = worker.traits.threads, now = worker.held.size();
  if (held_before > threads) job.backlogs.erase({held_before - threads, id});
  if (now > threads) job.backlogs.insert({now - threads, id});
}

void FarmLedger::revoke_all(Worker& worker) {
  const std::set<uint64_t> held = worker.held;
  for (const uint64_t number : held) {
    const Lease lease = leases_.at(number);
    Job& job = jobs_.at(lease.job);
    Unit& unit = job.units.at(lease.unit);
    release(number);
    if (unit.phase == Phase::kOpen) ++job.totals.reassigned;
    enqueue(job, lease.unit, unit);
  }
}

void FarmLedger::leave(WorkerId id, bool crashed, const std::string& reason, int64_t now, Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker) return;
  charge(*worker, now);
  const JobId job_id = worker->job;
  Job* job = find_job(job_id);
  out.push_back(Note{job_id, text("{} {}: {}; {} units go back", worker->traits.name,
                                  crashed ? "was lost" : "left", reason, worker->held.size())});
  if (crashed && job) {
    ++job->totals.lost;
    // A unit alone on the worker is to blame; otherwise all its units are suspects and will run alone. The
    // verdict waits for a lease, because the process may be alive behind a broken network.
    const bool certain = worker->held.size() == 1;
    const std::set<uint64_t> held = worker->held;
    for (const uint64_t number : held) {
      const uint64_t unit_id = leases_.at(number).unit;
      Unit& unit = job->units.at(unit_id);
      release(number);
      if (unit.phase == Phase::kOpen) ++job->totals.reassigned;
      const std::string why = text("{} was lost ({})", worker->traits.name, reason);
      losses_.push_back({worker->traits.process, worker->identity, now, certain, job_id, unit_id, why});
      blame(job_id, *job, unit_id, unit, worker->identity, false, why, out);
      unit.unjudged += certain;
      enqueue(*job, unit_id, unit);
    }
  }
  revoke_all(*worker);
  unassign(*worker, now);
  KILN_CHECK(worker->held.empty() && !worker->counted_for);
  workers_.erase(id);
  serve_all(0, now, out);
}

void FarmLedger::drain(WorkerId id, std::span<const uint64_t> unbegun, int64_t now, Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker) return;
  worker->presence = Presence::kDraining;
  worker->last_heard = now;
  out.push_back(Note{worker->job,
                     text("{} finishes its units and hands {} back", worker->traits.name, unbegun.size())});
  const std::set<uint64_t> held = worker->held;
  for (const uint64_t number : held) {
    const Lease lease = leases_.at(number);
    if (std::find(unbegun.begin(), unbegun.end(), lease.unit) == unbegun.end()) continue;
    release(number);
    Job& job = jobs_.at(lease.job);
    enqueue(job, lease.unit, job.units.at(lease.unit));
  }
  serve_all(0, now, out);
}

void FarmLedger::forgive_losses(uint64_t process) {
  for (const Loss& loss : losses_) {
    Job* job = loss.process == process ? find_job(loss.job) : nullptr;
    Unit* unit = job ? find_unit(*job, loss.unit) : nullptr;
    if (!unit) continue;
    if (loss.certain && unit->unjudged > 0) --unit->unjudged;
    if (unit->phase != Phase::kOpen) continue;
    std::erase(unit->blamed, loss.identity);
    if (unit->attempts > 0) --unit->attempts;
    if (unit->queue == Queue::kSuspect) dequeue(*job, loss.unit, *unit);
    enqueue(*job, loss.unit, *unit);
  }
  std::erase_if(losses_, [&](const Loss& loss) { return loss.process == process; });
}

void FarmLedger::judge_losses(int64_t now, Actions& out) {
  const int64_t patience = std::min(rules_.lease_ms, kReconnectMs);
  const auto due = [&](const Loss& loss) { return now - loss.when > patience; };
  for (const Loss& loss : losses_) {
    Job* job = due(loss) && loss.certain ? find_job(loss.job) : nullptr;
    Unit* unit = job ? find_unit(*job, loss.unit) : nullptr;
    if (!unit) continue;
    if (unit->unjudged > 0) --unit->unjudged;
    if (unit->phase != Phase::kOpen || !unit->answers.empty()) continue;
    if (++unit->failures < rules_.max_attempts) {
      enqueue(*job, loss.unit, *unit);
      continue;
    }
    dequeue(*job, loss.unit, *unit);
    give_up(loss.job, *job, loss.unit, *unit,
            text("unit {} failed {} times, the last time because {}", loss.unit, unit->failures, loss.reason),
            out);
  }
  std::erase_if(losses_, due);
}

void FarmLedger::charge(Worker& worker, int64_t now) {
  if (const Job* job = find_job(worker.job); job && !worker.held.empty())
    share_.charge(job->user, static_cast<double>(now - worker.charged_until) * worker.traits.threads,
                  job->weight);
  worker.charged_until = now;
}

void FarmLedger::find_silent(int64_t now, bool was_away, Actions& out) {
  for (auto& [id, worker] : workers_) {
    if (was_away) worker.last_heard = now;
    const bool known = worker.presence == Presence::kSilent ||
                       (worker.presence == Presence::kDraining && worker.held.empty());
    if (known || now - worker.last_heard <= rules_.lease_ms) continue;
    out.push_back(Note{worker.job, text("{} has been silent for {} ms; its {} units go to others",
                                        worker.traits.name, now - worker.last_heard, worker.held.size())});
    if (worker.presence == Presence::kActive) worker.presence = Presence::kSilent;
    charge(worker, now);
    worker.ghosts += worker.held.size();
    revoke_all(worker);
  }
}

// It sends heartbeats, but a unit that others finish in a fraction of the time does not end.
void FarmLedger::find_hung(int64_t now, Actions& out) {
  for (auto& [id, worker] : workers_) {
    if (worker.presence != Presence::kActive) continue;
    if (worker.job != 0 && !worker.ready && now - worker.assigned_at > rules_.hang_ms) {
      const std::string reason =
          text("its scene was not ready after {} s", (now - worker.assigned_at) / 1000);
      out.push_back(Note{worker.job, text("{} is not used: {}", worker.traits.name, reason)});
      out.push_back(Release{id, worker.job, reason});
      // Not forever: a slow link or disk may have recovered.
      worker.benched_until = now + (rules_.hang_ms << std::min(worker.benched++, 6u));
      unassign(worker, now);
    }
    if (worker.held.empty()) continue;
    const Lease oldest = leases_.at(*worker.held.begin());
    Job& job = jobs_.at(oldest.job);
    Unit& unit = job.units.at(oldest.unit);
    const double usual =
        job.turnaround_weight > 0 ? job.turnaround_ms / job.turnaround_weight * unit.weight : 0;
    const double limit = std::max(static_cast<double>(rules_.hang_ms), 100 * usual);
    if (static_cast<double>(now - oldest.since) <= limit) continue;
    worker.presence = Presence::kDraining;
    const std::string reason =
        text("unit {} of job {} has not ended within {:.0f} s: the worker hangs, start it anew", oldest.unit,
             oldest.job, limit / 1000);
    release(*worker.held.begin());
    blame(oldest.job, job, oldest.unit, unit, worker.identity, worker.ghosts == 0,
          text("{} hung", worker.traits.name), out);
    enqueue(job, oldest.unit, unit);
    out.push_back(Expel{id, reason});
  }
}

// Verification needs a second voter. Without one the job continues unverified and reports it; with a quorum
// set by the user it waits.
void FarmLedger::waive_audits(int64_t now, Actions& out) {
  for (auto& [id, job] : jobs_) {
    if (rules_.audit_first == 0 || job.traits.quorum > 1 || !job.open) continue;
    std::set<VoterId> able;
    for (const auto& [worker_id, worker] : workers_)
      if (worker.presence == Presence::kActive && may_work(id, job, worker))
        able.insert(identities_[worker.identity].voter);
    if (able.size() != 1) {
      job.alone_since = -1;
      job.alone = false;
      continue;
    }
    if (job.alone_since < 0) job.alone_since = now;
    job.alone = now - job.alone_since > rules_.lease_ms;
    if (!job.alone) continue;
    const std::set<uint64_t> seconds = job.seconds;
    for (const uint64_t unit_id : seconds) {
      Unit& unit = job.units.at(unit_id);
      if (unit.disputed || unit.needed <= 1) continue;
      unit.needed = 1;
      ++job.totals.waived;
      conclude(id, job, unit_id, unit, now, out);
    }
  }
}

// The job takes the first worker's class. If machines of that class are gone, or too few to decide, while
// machines of other classes wait, the job starts over with the class that most of them have: results of two
// classes are never mixed.
void FarmLedger::change_class(int64_t now, Actions& out) {
  for (auto& entry : jobs_) {
    const JobId id = entry.first;
    auto& job = entry.second;
    const bool could_go_on = std::any_of(workers_.begin(), workers_.end(), [&](const auto& w) {
      return w.second.presence == Presence::kActive && may_work(id, job, w.second) && has_work(job, w.second);
    });
    if (!job.open || job.traits.paused || !job.leases.empty() || could_go_on) {
      job.stuck_since = -1;
      continue;
    }
    if (job.stuck_since < 0) job.stuck_since = now;
    if (now - job.stuck_since <= rules_.class_patience_ms) continue;
    std::map<std::string, std::set<IdentityId>> by_class;
    for (const auto& [worker_id, its_class] : job.other_class) {
      const auto worker = workers_.find(worker_id);
      if (worker != workers_.end() && worker->second.presence == Presence::kActive)
        by_class[its_class].insert(worker->second.identity);
    }
    size_t able = 0, most = 0;
    std::string better;
    for (const auto& [worker_id, worker] : workers_)
      able += worker.presence == Presence::kActive && may_work(id, job, worker);
    for (const auto& [its_class, identities] : by_class)
      if (identities.size() > std::max(most, able)) most = identities.size(), better = its_class;
    if (better.empty()) continue;
    const std::string reason =
        text("no worker of numeric class {} could go on for {} s: the job starts over with {}",
             job.traits.numeric_class, rules_.class_patience_ms / 1000, better);
    for (const auto& [worker_id, its_class] : job.other_class)
      if (const auto worker = workers_.find(worker_id); worker != workers_.end())
        worker->second.banned.erase(id);
    job.other_class.clear();
    for (auto& [worker_id, worker] : workers_) {
      const auto its_class = worker.classes.find(id);
      if (its_class == worker.classes.end() || its_class->second == better) continue;
      worker.banned[id] = reason;
      job.other_class[worker_id] = its_class->second;
      if (worker.job != id) continue;
      unassign(worker, now);
      out.push_back(Release{worker_id, id, reason});
    }
    std::vector<uint64_t> units;
    for (const auto& [unit_id, unit] : job.units) units.push_back(unit_id);
    std::sort(units.begin(), units.end());
    for (const uint64_t unit_id : units) {
      Unit& unit = job.units.at(unit_id);
      dequeue(job, unit_id, unit);
      for (const Answer& answer : unit.answers) out.push_back(Revoke{id, unit_id, answer.digest});
    }
    job.units.clear();
    job.order.clear();
    job.disputes = 0;
    job.totals.verified = job.totals.unverified = 0;
    job.traits.numeric_class = better;
    out.push_back(PinClass{id, better});
    rewind(id, job, reason, out);
  }
}

void FarmLedger::tick(int64_t now, Actions& out) {
  // Silence while we were not listening (stopped by a debugger, a busy disk) is not the workers' fault.
  const int64_t gap = now - last_tick_;
  const bool was_away = gap > rules_.lease_ms / 2;
  last_tick_ = now;
  if (was_away)
    for (auto& [number, lease] : leases_) lease.since = std::min(now, lease.since + gap);
  find_silent(now, was_away, out);
  find_hung(now, out);
  judge_losses(now, out);
  waive_audits(now, out);
  change_class(now, out);
  for (auto& [id, worker] : workers_) charge(worker, now);
  find_spare(now);
  balance(now);
  serve_all(0, now, out);
}

}  // namespace kiln
