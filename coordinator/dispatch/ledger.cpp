#include "coordinator/dispatch/ledger.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {

Ledger::UnitState* Ledger::find_unit(uint64_t unit) {
  const auto it = units_.find(unit);
  return it == units_.end() ? nullptr : &it->second;
}

Ledger::Worker* Ledger::find_worker(WorkerId worker) {
  const auto it = workers_.find(worker);
  return it == workers_.end() || it->second.presence == Presence::kGone ? nullptr : &it->second;
}

bool Ledger::asked_for(uint64_t unit) const {
  return units_.count(unit) || digests_.count(unit) || abandoned_.count(unit);
}

bool Ledger::is_member(WorkerId worker) const {
  const auto it = workers_.find(worker);
  return it != workers_.end() && it->second.presence != Presence::kGone;
}

size_t Ledger::held(WorkerId worker) const {
  const auto it = workers_.find(worker);
  return it == workers_.end() ? 0 : it->second.held.size();
}

uint32_t Ledger::present() const {
  return static_cast<uint32_t>(std::count_if(workers_.begin(), workers_.end(), [](const auto& w) {
    return w.second.presence == Presence::kActive;
  }));
}

void Ledger::begin_pass(std::span<const uint64_t> units, int64_t now, Actions& out) {
  end_pass();
  for (uint64_t unit : units) {
    KILN_CHECK(!asked_for(unit));
    units_.emplace(unit, UnitState{}).first->second.queued = true;
    pending_.push_back(unit);
  }
  tick(now, out);
}

void Ledger::end_pass() {
  for (const auto& [unit, state] : units_)
    if (!state.committed) abandoned_.insert(unit);
  units_.clear();
  pending_.clear();
  suspects_.clear();
  audits_.clear();
  done_ = audits_open_ = 0;
  turnaround_sum_ = 0;
  turnaround_count_ = 0;
}

void Ledger::join(WorkerId id, const std::string& name, const std::string& numeric_class, uint32_t threads,
                  uint32_t credits, int64_t now, Actions& out) {
  if (class_.empty()) class_ = numeric_class;
  Worker& worker = workers_[id];
  worker.name = name;
  worker.threads = std::max(1u, threads);
  worker.credits = credits;
  worker.last_heard = now;
  if (numeric_class != class_) {
    worker.presence = Presence::kDraining;
    out.push_back(
        Expel{id, text("numeric class {} differs from the job's {}: its results would differ in the "
                       "last bits; give this job workers with the same processor features, or "
                       "choose kernels that all of them have with --isa",
                       numeric_class, class_)});
    return;
  }
  worker.presence = Presence::kActive;
  out.push_back(Note{text("{} joined with {} threads, class {}", name, worker.threads, numeric_class)});
  grant_all(now, out);
}

void Ledger::heard(WorkerId id, int64_t now, Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker) return;
  worker->last_heard = now;
  if (worker->presence != Presence::kSilent) return;
  worker->presence = Presence::kActive;
  out.push_back(Note{text("{} is back", worker->name)});
  grant_all(now, out);
}

void Ledger::release(uint64_t lease) {
  const auto it = leases_.find(lease);
  if (it == leases_.end()) return;
  workers_[it->second.worker].held.erase(lease);
  if (UnitState* unit = find_unit(it->second.unit)) --unit->leases;
  leases_.erase(it);
}

// Back to the queue, unless the unit is done, waits already or somebody else still has it.
void Ledger::requeue(uint64_t id, bool suspect) {
  UnitState* unit = find_unit(id);
  if (!unit || unit->queued || unit->leases > 0) return;
  if (unit->committed) {
    if (unit->audit) audits_.push_back(id);
    return;
  }
  unit->queued = true;
  if (suspect || unit->attempts > 0)
    suspects_.push_back(id);
  else
    pending_.push_front(id);
}

void Ledger::revoke_all(Worker& worker) {
  const std::set<uint64_t> held = worker.held;
  // Backwards, so that push_front leaves the units in their order.
  for (auto lease = held.rbegin(); lease != held.rend(); ++lease) {
    const uint64_t unit = leases_.at(*lease).unit;
    release(*lease);
    const UnitState* state = find_unit(unit);
    if (state && !state->committed) ++reassigned_;
    requeue(unit, false);
  }
}

void Ledger::leave(WorkerId id, bool crashed, const std::string& reason, int64_t now, Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker) return;
  if (crashed) ++lost_;
  out.push_back(Note{text("{} {}: {}; {} units go back", worker->name, crashed ? "was lost" : "left", reason,
                          worker->held.size())});
  if (crashed) {
    // Alone with the worker, the unit is to blame; else any of them is suspected and gets to run alone.
    const bool certain = worker->held.size() == 1;
    for (uint64_t lease : worker->held)
      blame(leases_.at(lease).unit, id, certain, text("{} was lost ({})", worker->name, reason), out);
  }
  revoke_all(*worker);
  worker->presence = Presence::kGone;
  grant_all(now, out);
}

void Ledger::blame(uint64_t id, WorkerId worker, bool certain, const std::string& reason, Actions& out) {
  UnitState* unit = find_unit(id);
  if (!unit || unit->committed) return;
  unit->blamed.insert(worker);
  ++unit->attempts;
  if (certain && unit->attempts >= settings_.max_attempts)
    fail_pass(ErrorKind::kInternal,
              text("unit {} failed {} times, the last time because {}", id, unit->attempts, reason), out);
}

void Ledger::fail_pass(ErrorKind kind, std::string message, Actions& out) {
  failed_ = true;
  out.push_back(FailPass{Error{kind, std::move(message)}});
}

void Ledger::drain(WorkerId id, std::span<const uint64_t> unbegun, int64_t now, Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker) return;
  worker->presence = Presence::kDraining;
  worker->last_heard = now;
  out.push_back(Note{text("{} finishes its units and hands {} back", worker->name, unbegun.size())});
  const std::set<uint64_t> held = worker->held;
  for (auto lease = held.rbegin(); lease != held.rend(); ++lease) {
    const uint64_t unit = leases_.at(*lease).unit;
    if (std::find(unbegun.begin(), unbegun.end(), unit) == unbegun.end()) continue;
    release(*lease);
    requeue(unit, false);
  }
  grant_all(now, out);
}

void Ledger::settle_duplicate(const Worker& worker, uint64_t id, const Digest& digest, Actions& out) {
  ++duplicates_;
  const Digest& committed = digests_.at(id);
  if (committed != digest) {
    const std::string alarm = text(
        "unit {} was answered twice with different bytes: {} sent {}, committed was {}. One of the machines "
        "computes wrongly or runs another build",
        id, worker.name, digest.hex(), committed.hex());
    out.push_back(Note{alarm});
    fail_pass(ErrorKind::kInternal, alarm, out);
    return;
  }
  UnitState* unit = find_unit(id);
  if (!unit || !unit->audit) return;
  unit->audit = false;
  --audits_open_;
  std::erase(audits_, id);
}

void Ledger::result(WorkerId id, uint64_t lease, uint64_t unit_id, const Digest& digest, int64_t now,
                    Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker) return;
  heard(id, now, out);
  if (const auto it = leases_.find(lease);
      it != leases_.end() && it->second.worker == id && it->second.unit == unit_id) {
    turnaround_sum_ += now - it->second.since;
    ++turnaround_count_;
    release(lease);
  }
  UnitState* unit = find_unit(unit_id);
  if (digests_.count(unit_id)) {
    settle_duplicate(*worker, unit_id, digest, out);
  } else if (unit) {
    unit->committed = true;
    unit->committer = id;
    if (unit->queued) {  // its lease had been revoked; the late answer is as good
      unit->queued = false;
      std::erase(pending_, unit_id);
      std::erase(suspects_, unit_id);
    }
    digests_.emplace(unit_id, digest);
    ++done_;
    if (settings_.duplicate_every_unit) {
      unit->audit = true;
      ++audits_open_;
      if (unit->leases == 0) audits_.push_back(unit_id);
    }
    out.push_back(Commit{id, unit_id});
  }
  out.push_back(Acknowledge{id, unit_id, digest});
  grant_all(now, out);
}

void Ledger::unit_failed(WorkerId id, uint64_t lease, uint64_t unit, const Error& error, int64_t now,
                         Actions& out) {
  Worker* worker = find_worker(id);
  if (!worker) return;
  heard(id, now, out);
  const auto it = leases_.find(lease);
  if (it == leases_.end() || it->second.worker != id || it->second.unit != unit) return;  // not its to fail
  out.push_back(Note{text("unit {} failed on {}: {}", unit, worker->name, error.message)});
  if (error.kind == ErrorKind::kInvalidInput || error.kind == ErrorKind::kUsage)
    fail_pass(error.kind, text("unit {}: {}", unit, error.message), out);  // would fail everywhere
  else
    blame(unit, id, true, text("{}: {}", worker->name, error.message), out);
  release(lease);
  requeue(unit, true);
  grant_all(now, out);
}

void Ledger::tick(int64_t now, Actions& out) {
  // Silence while we did not listen (merging, stopped by a debugger) is not the workers'.
  const bool was_away = now - last_tick_ > settings_.lease_ms / 2;
  last_tick_ = now;
  for (auto& [id, worker] : workers_) {
    if (was_away) worker.last_heard = now;
    const bool counts = worker.presence == Presence::kActive || worker.presence == Presence::kDraining;
    if (!counts || now - worker.last_heard <= settings_.lease_ms) continue;
    out.push_back(Note{text("{} has been silent for {} ms; its {} units go to others", worker.name,
                            now - worker.last_heard, worker.held.size())});
    worker.presence = Presence::kSilent;
    revoke_all(worker);
  }
  grant_all(now, out);
}

}  // namespace kiln
