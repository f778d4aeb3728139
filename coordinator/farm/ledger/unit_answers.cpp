// The table of units: answers, disputes and results.
#include <algorithm>

#include "common/base/check.h"
#include "coordinator/farm/ledger/unit_table.h"

namespace kiln {

void UnitTable::restore(JobId id, const KnownAnswer& known, IdentityId who) {
  Job& job = edit(id);
  Unit& unit = job.units[known.unit];
  if (unit.phase == Phase::kSettled) return;
  unit.shape = known.shape;
  if (known.settled) {
    unit.answers.clear();  // a result ends every dispute
    unit.phase = Phase::kSettled;
    unit.verified = known.verified;
    ++(known.verified ? job.totals.verified : job.totals.unverified);
  }
  unit.answers.push_back({known.digest, {who}, true, 0, {}});
}

size_t UnitTable::most_votes(const Unit& unit) const {
  size_t most = 0;
  for (const Answer& answer : unit.answers) most = std::max(most, votes(answer));
  return most;
}

size_t UnitTable::leading(const Unit& unit) const {
  KILN_CHECK(!unit.answers.empty());
  size_t best = 0;
  for (size_t i = 1; i < unit.answers.size(); ++i)
    if (votes(unit.answers[i]) > votes(unit.answers[best])) best = i;
  return best;
}

bool UnitTable::voted(const Unit& unit, IdentityId who) const {
  return std::any_of(unit.answers.begin(), unit.answers.end(),
                     [&](const Answer& answer) { return trust_.is_among(answer.voters, who); });
}

size_t UnitTable::add_answer(const Ref& ref, const Digest& digest) {
  ref.unit_->answers.push_back(Answer{digest, {}, false, next_ticket_++, {}});
  return ref->answers.size() - 1;
}

void UnitTable::add_vote(const Ref& ref, size_t answer, IdentityId who) {
  KILN_CHECK(answer < ref->answers.size());
  ref.unit_->answers[answer].voters.push_back(who);
}

void UnitTable::await_commit(const Ref& ref, size_t answer, WorkerId worker) {
  KILN_CHECK(answer < ref->answers.size() && !ref->answers[answer].stored);
  ref.unit_->answers[answer].waiting.push_back(worker);
}

bool UnitTable::commit(const Ref& ref, uint64_t ticket, Digest& digest, std::vector<WorkerId>& waiting) {
  for (Answer& answer : ref.unit_->answers) {
    if (answer.ticket != ticket) continue;
    answer.stored = true;
    digest = answer.digest;
    waiting = std::move(answer.waiting);
    answer.waiting.clear();
    return true;
  }
  return false;
}

std::vector<UnitTable::Answer> UnitTable::settle(const Ref& ref, size_t winner) {
  Job& job = *ref.job_;
  Unit& unit = *ref.unit_;
  KILN_CHECK(unit.phase == Phase::kOpen && unit.answers[winner].stored);
  KILN_CHECK(votes(unit.answers[winner]) >= unit.needed);
  std::vector<Answer> answers = std::move(unit.answers);
  unit.answers.clear();
  unit.answers.push_back(answers[winner]);
  unit.phase = Phase::kSettled;
  unit.verified = votes(answers[winner]) > 1;
  ++(unit.verified ? job.totals.verified : job.totals.unverified);
  KILN_CHECK(!unit.disputed || job.disputes > 0);
  if (unit.disputed) --job.disputes;
  unit.disputed = false;
  return answers;
}

void UnitTable::confirm(const Ref& ref) {
  KILN_CHECK(ref->phase == Phase::kSettled && !ref->verified && ref.job_->totals.unverified > 0);
  ref.unit_->verified = true;
  ++ref.job_->totals.verified;
  --ref.job_->totals.unverified;
}

void UnitTable::reopen(const Ref& ref) {
  Job& job = *ref.job_;
  Unit& unit = *ref.unit_;
  uint64_t& results = unit.verified ? job.totals.verified : job.totals.unverified;
  KILN_CHECK(unit.phase == Phase::kSettled && results > 0);
  --results;
  unit.phase = Phase::kOpen;
  unit.verified = false;
  if (!ref.of_pass()) return;
  KILN_CHECK(job.counts.done > 0);
  --job.counts.done;
  job.counts.weight_done -= unit.weight;
}

void UnitTable::drop_answers(const Ref& ref) {
  KILN_CHECK(ref->phase == Phase::kOpen);
  ref.unit_->answers.clear();
  ref.unit_->needed = 0;
}

void UnitTable::dispute(const Ref& ref) {
  KILN_CHECK(ref.of_pass() && !ref->disputed);
  ref.unit_->disputed = true;
  ++ref.job_->disputes;
}

void UnitTable::resolve_if_one_answer(const Ref& ref) {
  if (!ref->disputed || ref->answers.size() >= 2) return;
  ref.unit_->disputed = false;
  --ref.job_->disputes;
}

UnitTable::Purged UnitTable::purge(JobId id, IdentityId who, Actions& out) {
  Purged purged;
  std::vector<Revoke> revoked;
  Job& job = edit(id);
  for (auto& [unit_id, unit] : job.units) {
    const Ref ref(id, unit_id, job, unit);
    absolve(ref, who);  // its failures say nothing about the unit
    const bool alone = unit.phase == Phase::kSettled && !unit.verified;
    if (unit.phase != Phase::kOpen && !alone) continue;
    bool changed = false;
    for (Answer& answer : unit.answers) changed |= std::erase(answer.voters, who) > 0;
    if (!changed) continue;
    purged.units.push_back(unit_id);
    for (const Answer& answer : unit.answers)
      if (answer.voters.empty()) revoked.push_back({id, unit_id, answer.digest});
    std::erase_if(unit.answers, [](const Answer& answer) { return answer.voters.empty(); });
    if (!alone) continue;
    ++purged.revoked;
    KILN_CHECK(unit.answers.size() <= 1);
    purged.merged |= unit.delivered;
    reopen(ref);
    unit.needed = 0;
  }
  // The hash map's order is not the work's order.
  std::sort(purged.units.begin(), purged.units.end());
  std::stable_sort(revoked.begin(), revoked.end(),
                   [](const auto& a, const auto& b) { return a.unit < b.unit; });
  out.insert(out.end(), revoked.begin(), revoked.end());
  return purged;
}

}  // namespace kiln
