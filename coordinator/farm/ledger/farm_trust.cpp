#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {
namespace {

constexpr size_t kFailuresToBench = 3;    // different units in a row
constexpr int64_t kFirstBenchMs = 30000;  // doubles each time

// Uniform in [0, 1), the same for the same unit.
double draw(uint64_t seed, JobId job, uint64_t unit) {
  const uint64_t key[3] = {seed, job, unit};
  return std::ldexp(static_cast<double>(xxh3(std::as_bytes(std::span(key))) >> 11), -53);
}

}  // namespace

FarmLedger::IdentityId FarmLedger::intern(const std::string& name) {
  const auto [it, added] = identity_by_name_.try_emplace(name, static_cast<IdentityId>(identities_.size()));
  if (added) identities_.push_back({name, kUnknownVoter, 0, false, ""});
  return it->second;
}

FarmLedger::VoterId FarmLedger::intern_voter(const std::string& name) {
  return voter_by_name_.try_emplace(name, static_cast<VoterId>(voter_by_name_.size() + 1)).first->second;
}

bool FarmLedger::same_voter(IdentityId a, IdentityId b) const {
  return a == b || (identities_[a].voter != kUnknownVoter && identities_[a].voter == identities_[b].voter);
}

// A vote whose voter is not known may be anybody's, also one that is counted already: together all such votes
// count at most once, and only where there is no other.
size_t FarmLedger::votes(const Answer& answer) const {
  size_t count = 0;
  for (size_t i = 0; i < answer.voters.size(); ++i) {
    const VoterId voter = identities_[answer.voters[i]].voter;
    const auto before = answer.voters.begin() + static_cast<ptrdiff_t>(i);
    count += voter != kUnknownVoter && std::none_of(answer.voters.begin(), before, [&](IdentityId other) {
               return identities_[other].voter == voter;
             });
  }
  return std::max<size_t>(count, answer.voters.empty() ? 0 : 1);
}

bool FarmLedger::voted(const Unit& unit, IdentityId who) const {
  return std::any_of(unit.answers.begin(), unit.answers.end(), [&](const Answer& answer) {
    return std::any_of(answer.voters.begin(), answer.voters.end(),
                       [&](IdentityId voter) { return same_voter(voter, who); });
  });
}

void FarmLedger::restore_trust(const std::string& name, uint64_t agreed, const std::string& quarantined_for) {
  Identity& identity = identities_[intern(name)];
  identity.agreed = agreed;
  identity.quarantined = !quarantined_for.empty();
  identity.reason = quarantined_for;
}

void FarmLedger::forgive(const std::string& name) {
  restore_trust(name, 0, "");
}

const std::string* FarmLedger::quarantined_for(const std::string& name) const {
  const auto it = identity_by_name_.find(name);
  if (it == identity_by_name_.end() || !identities_[it->second].quarantined) return nullptr;
  return &identities_[it->second].reason;
}

void FarmLedger::agree(IdentityId id, Actions& out) {
  KILN_CHECK(id < identities_.size());
  out.push_back(Trust{identities_[id].name, ++identities_[id].agreed});
}

Verification FarmLedger::verification(JobId id) const {
  Verification v;
  const Job* job = find_job(id);
  if (!job) return v;
  v.verified = job->totals.verified;
  v.unverified = job->totals.unverified;
  v.waived = job->totals.waived;
  v.quorum = job->traits.quorum;
  v.owners_known = rules_.owners_known;
  v.trusted = rules_.audit_first == 0 && job->traits.quorum == 1;
  std::map<IdentityId, Contribution> by;
  for (const auto& [unit_id, unit] : job->units) {
    if (unit.phase != Phase::kSettled) continue;
    const std::vector<IdentityId>& voters = unit.answers.front().voters;
    for (size_t i = 0; i < voters.size(); ++i) {
      Contribution& its = by[voters[i]];
      if (i > 0) {
        ++its.confirmed;
      } else {
        ++its.gave;
        its.alone += !unit.verified;
      }
    }
  }
  for (auto& [who, contribution] : by) {
    contribution.identity = identities_[who].name;
    v.by.push_back(std::move(contribution));
  }
  std::sort(v.by.begin(), v.by.end(), [](const auto& a, const auto& b) { return a.identity < b.identity; });
  return v;
}

uint32_t FarmLedger::needed_votes(JobId id, const Job& job, uint64_t unit_id, IdentityId first) const {
  KILN_CHECK(job.traits.quorum > 0 && first < identities_.size());
  if (job.traits.quorum > 1) return job.traits.quorum;
  if (rules_.audit_first == 0 || job.alone) return 1;
  const uint64_t agreed = identities_[first].agreed;
  if (agreed < rules_.audit_first) return 2;
  const double share = std::max(rules_.audit_least, 1.0 / static_cast<double>(agreed));
  return draw(rules_.audit_seed, id, unit_id) < share ? 2 : 1;
}

void FarmLedger::quarantine(const std::string& name, const std::string& reason, int64_t now, Actions& out) {
  quarantine(intern(name), reason, now, out);
}

// Answers that it alone gave are dropped and baked again; confirmed ones stay.
void FarmLedger::quarantine(IdentityId who, const std::string& reason, int64_t now, Actions& out) {
  if (identities_[who].quarantined) return;
  identities_[who].quarantined = true;
  identities_[who].reason = reason;
  out.push_back(Quarantine{identities_[who].name, reason});
  out.push_back(Note{0, text("{} is quarantined: {}", identities_[who].name, reason)});
  for (auto& [id, worker] : workers_) {
    if (worker.identity != who) continue;
    worker.presence = Presence::kDraining;
    charge(worker, now);
    revoke_all(worker);
    out.push_back(Expel{id, reason});
  }
  for (auto& [id, job] : jobs_) {
    uint64_t revoked = 0;
    bool merged = false;
    std::vector<uint64_t> again;
    for (auto& [unit_id, unit] : job.units) {
      std::erase(unit.blamed, who);  // its failures say nothing about the unit
      const bool alone = unit.phase == Phase::kSettled && !unit.verified;
      if (unit.phase != Phase::kOpen && !alone) continue;
      bool changed = false;
      for (Answer& answer : unit.answers) changed |= std::erase(answer.voters, who) > 0;
      if (!changed) continue;
      again.push_back(unit_id);
      for (const Answer& answer : unit.answers)
        if (answer.voters.empty()) out.push_back(Revoke{id, unit_id, answer.digest});
      std::erase_if(unit.answers, [](const Answer& answer) { return answer.voters.empty(); });
      if (!alone) continue;
      ++revoked;
      KILN_CHECK(job.totals.unverified > 0 && unit.answers.size() <= 1);
      --job.totals.unverified;
      merged |= unit.delivered;
      if (job.open && unit.pass == job.pass) {
        --job.counts.done;
        job.counts.weight_done -= unit.weight;
      }
      unit.phase = Phase::kOpen;
      unit.needed = 0;
    }
    // The hash map's order is not the work's order.
    std::sort(again.begin(), again.end());
    if (merged)
      rewind(id, job, text("{} results of {} are baked again: {}", revoked, identities_[who].name, reason),
             out);
    for (const uint64_t unit_id : again) {
      Unit& unit = job.units.at(unit_id);
      if (unit.disputed && unit.answers.size() < 2) {
        unit.disputed = false;
        --job.disputes;
      }
      if (unit.answers.empty()) {
        dequeue(job, unit_id, unit);
        unit.needed = 0;
        enqueue(job, unit_id, unit);
      } else {
        conclude(id, job, unit_id, unit, now, out);
      }
    }
    complete_if_done(id, job, out);
  }
  serve_all(0, now, out);
}

// A machine that fails one unit after another is a likelier culprit than every one of the units.
void FarmLedger::bench(WorkerId, Worker& worker, int64_t now, Actions& out) {
  if (worker.failed_units.size() < kFailuresToBench) return;
  bool others = false;
  for (const auto& [id, other] : workers_)
    others |= other.identity != worker.identity && other.presence == Presence::kActive &&
              now >= other.benched_until;
  if (!others) return;  // a single machine continues
  const int64_t pause = kFirstBenchMs << std::min(worker.benched++, 10u);
  worker.benched_until = now + pause;
  for (const uint64_t unit_id : worker.failed_units) {
    Job* job = find_job(worker.job);
    Unit* unit = job ? find_unit(*job, unit_id) : nullptr;
    if (!unit || std::erase(unit->blamed, worker.identity) == 0) continue;
    dequeue(*job, unit_id, *unit);
    if (unit->attempts > 0) --unit->attempts;
    if (unit->failures > 0) --unit->failures;
    enqueue(*job, unit_id, *unit);
  }
  worker.failed_units.clear();
  out.push_back(Note{worker.job, text("{} failed {} units in a row: it gets none for {} s",
                                      worker.traits.name, kFailuresToBench, pause / 1000)});
}

}  // namespace kiln
