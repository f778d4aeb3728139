#include <algorithm>

#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {
namespace {

constexpr size_t kFailuresToBench = 3;    // different units in a row
constexpr int64_t kFirstBenchMs = 30000;  // doubles each time

}  // namespace

void FarmLedger::restore_trust(const std::string& name, uint64_t agreed, const std::string& quarantined_for) {
  trust_.restore(name, agreed, quarantined_for);
}

void FarmLedger::quarantine(const std::string& name, const std::string& reason, int64_t now, Actions& out) {
  quarantine(trust_.intern(name), reason, time_.advance(now), out);
}

// Answers that it alone gave are dropped and baked again; confirmed ones stay.
void FarmLedger::quarantine(IdentityId who, const std::string& reason, int64_t now, Actions& out) {
  if (!trust_.quarantine(who, reason, out)) return;
  workers_.for_each([&](const WorkerRef& worker) {
    if (worker->identity != who) return;
    workers_.set_presence(worker, Presence::kDraining);
    workers_.charge(worker, now);
    revoke_all(worker);
    out.push_back(Expel{worker.id(), reason});
  });
  for (const auto& [id, job] : units_.jobs()) {
    const UnitTable::Purged purged = units_.purge(id, who, out);
    if (purged.merged)
      rewind(id, text("{} results of {} are baked again: {}", purged.revoked, trust_.at(who).name, reason),
             out);
    for (const uint64_t unit_id : purged.units) {
      const UnitRef unit = units_.find(id, unit_id);
      units_.resolve_if_one_answer(unit);
      if (unit->answers.empty()) {
        units_.dequeue(unit);
        units_.require(unit, 0);
        units_.enqueue(unit);
      } else {
        conclude(unit, now, out);
      }
    }
    units_.complete_if_done(id, out);
  }
  serve_all(0, now, out);
}

// A machine that fails one unit after another is a likelier culprit than every one of the units.
void FarmLedger::bench(const WorkerRef& worker, int64_t now, Actions& out) {
  if (worker->failed_units.size() < kFailuresToBench) return;
  const bool others = std::any_of(workers_.all().begin(), workers_.all().end(), [&](const auto& entry) {
    const WorkerTable::Worker& other = entry.second;
    return other.identity != worker->identity && other.presence == Presence::kActive &&
           now >= other.benched_until;
  });
  if (!others) return;  // a single machine continues
  const int64_t pause = kFirstBenchMs << std::min(worker->benched, 10u);
  workers_.bench(worker, now + pause);
  for (const auto& [job, unit_id] : worker->failed_units)
    if (const UnitRef unit = units_.find(job, unit_id)) units_.absolve(unit, worker->identity);
  workers_.clear_failed(worker);
  out.push_back(Note{worker->job, text("{} failed {} units in a row: it gets none for {} s",
                                       worker->traits.name, kFailuresToBench, pause / 1000)});
}

}  // namespace kiln
