// Who gets what next. In this order: a unit that cost a worker, alone on a worker that holds nothing; the
// next unit in order; a second answer where every unit is asked twice; a copy of a unit that is late.
#include <algorithm>

#include "coordinator/dispatch/ledger.h"

namespace kiln {

bool Ledger::holds_suspect(const Worker& worker) const {
  return std::any_of(worker.held.begin(), worker.held.end(), [&](uint64_t lease) {
    const auto unit = units_.find(leases_.at(lease).unit);
    return unit != units_.end() && unit->second.attempts > 0 && !unit->second.committed;
  });
}

// A suspect this worker has not failed; one that every active worker has failed may go anywhere.
std::deque<uint64_t>::iterator Ledger::choose_suspect(WorkerId id) {
  return std::find_if(suspects_.begin(), suspects_.end(), [&](uint64_t unit) {
    const std::set<WorkerId>& blamed = units_.at(unit).blamed;
    if (!blamed.count(id)) return true;
    return std::all_of(workers_.begin(), workers_.end(), [&](const auto& w) {
      return w.second.presence != Presence::kActive || blamed.count(w.first);
    });
  });
}

// Another worker than the first time, if there is one.
std::deque<uint64_t>::iterator Ledger::choose_audit(WorkerId id) {
  const bool alone = present() < 2;
  return std::find_if(audits_.begin(), audits_.end(),
                      [&](uint64_t unit) { return alone || units_.at(unit).committer != id; });
}

// Oldest lease that has taken twice the usual time, of a unit that nobody else has; once per unit.
const Ledger::Lease* Ledger::choose_copy(WorkerId id, int64_t now) const {
  const int64_t usual =
      turnaround_count_ ? turnaround_sum_ / static_cast<int64_t>(turnaround_count_) : settings_.lease_ms / 2;
  for (const auto& [number, lease] : leases_) {
    if (now - lease.since <= 2 * usual) return nullptr;  // and so are all younger ones
    const auto unit = units_.find(lease.unit);
    if (unit == units_.end() || lease.worker == id) continue;
    const UnitState& state = unit->second;
    if (!state.committed && !state.copied && state.attempts == 0 && state.leases == 1) return &lease;
  }
  return nullptr;
}

bool Ledger::grant_one(WorkerId id, Worker& worker, int64_t now, Actions& out) {
  if (worker.presence != Presence::kActive || worker.held.size() >= worker.credits) return false;
  if (holds_suspect(worker)) return false;
  uint64_t unit = 0;
  if (const auto s = choose_suspect(id); worker.held.empty() && s != suspects_.end()) {
    unit = *s;
    suspects_.erase(s);
  } else if (!pending_.empty()) {
    unit = pending_.front();
    pending_.pop_front();
  } else if (const auto a = choose_audit(id); a != audits_.end()) {
    unit = *a;
    audits_.erase(a);
  } else if (const Lease* late = choose_copy(id, now); late && worker.held.size() < worker.threads) {
    unit = late->unit;
    units_.at(unit).copied = true;
    out.push_back(Note{"unit " + std::to_string(unit) + " is late: " + worker.name + " gets a copy"});
  } else {
    return false;
  }
  UnitState& state = units_.at(unit);
  state.queued = false;
  ++state.leases;
  leases_.emplace(next_lease_, Lease{id, unit, now});
  worker.held.insert(next_lease_);
  out.push_back(Grant{id, next_lease_++, unit});
  return true;
}

// One at a time to whoever holds least for its size, so that the last units spread over all workers.
void Ledger::grant_all(int64_t now, Actions& out) {
  if (failed_) return;
  std::vector<std::pair<const WorkerId, Worker>*> able;
  for (auto& entry : workers_)
    if (entry.second.presence == Presence::kActive && entry.second.held.size() < entry.second.credits)
      able.push_back(&entry);
  const auto load = [](const auto* e) { return double(e->second.held.size()) / e->second.threads; };
  while (!able.empty()) {
    const auto least =
        std::min_element(able.begin(), able.end(), [&](auto* a, auto* b) { return load(a) < load(b); });
    if (!grant_one((*least)->first, (*least)->second, now, out)) able.erase(least);
  }
}

}  // namespace kiln
