#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {
namespace {

constexpr size_t kMaxDifferentAnswers = 5;  // of one unit, before the job itself is considered at fault

}  // namespace

void FarmLedger::result(WorkerId worker_id, JobId job_id, uint64_t unit_id, const Digest& digest, int64_t now,
                        Actions& out) {
  now = time_.advance(now);
  const WorkerRef worker = workers_.find(worker_id);
  if (!worker) return;
  hear(worker_id, now, out);
  const UnitRef unit = units_.find(job_id, unit_id);
  if (!unit) {
    out.push_back(Release{worker_id, job_id, "the job has ended"});
    return;
  }
  if (trust_.at(worker->identity).quarantined) return;
  const auto its_class = worker->classes.find(job_id);
  if (its_class == worker->classes.end()) return;  // it is sent again when the worker is ready for the job
  if (its_class->second != unit.job().traits.numeric_class) {
    if (worker->job != job_id)
      out.push_back(Release{worker_id, job_id, "the job needs another numeric class"});
    return;
  }
  if (const uint64_t lease = grants_.find(worker_id, *unit)) {
    grants_.answered(lease, now);
    workers_.charge(worker, now);
    grants_.release(lease);
  } else {
    grants_.answered_without_lease(worker);
  }
  workers_.clear_failed(worker);
  if (unit->phase == Phase::kFailed) {
    out.push_back(Acknowledge{worker_id, job_id, unit_id, digest});
  } else {
    vote(unit, worker, digest, now, out);
    units_.enqueue(unit);  // its lease is free now, and the vote may already have counted
  }
  serve(worker_id, now, out);
}

uint32_t FarmLedger::needed_votes(const UnitRef& unit, IdentityId first) const {
  return trust_.needed_votes(unit.job_id(), unit.id(), unit.job().traits.quorum, first,
                             workers_.lack(unit.job_id()).alone);
}

bool FarmLedger::vote_again(const UnitRef& unit, const WorkerRef& worker, const Digest& digest, int64_t now,
                            Actions& out) {
  const IdentityId who = worker->identity;
  for (size_t i = 0; i < unit->answers.size(); ++i) {
    const Answer& answer = unit->answers[i];
    if (std::find(answer.voters.begin(), answer.voters.end(), who) == answer.voters.end()) continue;
    units_.count(unit.job_id(), &JobCounts::duplicates);
    if (answer.digest != digest)
      quarantine(who,
                 text("it answered unit {} of job {} twice with different bytes: {} and {}", unit.id(),
                      unit.job_id(), answer.digest.hex(), digest.hex()),
                 now, out);
    else if (answer.stored)
      out.push_back(Acknowledge{worker.id(), unit.job_id(), unit.id(), digest});
    else
      units_.await_commit(unit, i, worker.id());
    return true;
  }
  return false;
}

// Of a unit that has its result.
bool FarmLedger::vote_late(const UnitRef& unit, const WorkerRef& worker, const Digest& digest, int64_t now,
                           Actions& out) {
  KILN_CHECK(unit->phase == Phase::kSettled && unit->answers.size() == 1);
  const IdentityId who = worker->identity;
  units_.count(unit.job_id(), &JobCounts::duplicates);
  const Answer& result = unit->answers.front();
  if (result.digest == digest) {
    const size_t before = units_.votes(result);
    units_.add_vote(unit, 0, who);
    if (unit->verified && units_.votes(result) > before) trust_.agree(who, out);
    if (!unit->verified && units_.votes(result) > 1) {
      for (const IdentityId voter : result.voters) trust_.agree(voter, out);
      units_.confirm(unit);
      out.push_back(Settle{unit.job_id(), unit.id(), digest, true, trust_.at(result.voters.front()).name});
    }
    out.push_back(Acknowledge{worker.id(), unit.job_id(), unit.id(), digest});
    return true;
  }
  if (unit->verified) {
    quarantine(who,
               text("its answer to unit {} of job {}, {}, differs from {}, which two others gave", unit.id(),
                    unit.job_id(), digest.hex(), result.digest.hex()),
               now, out);
    return true;
  }
  dispute(unit, out);
  return false;
}

void FarmLedger::vote(const UnitRef& unit, const WorkerRef& worker, const Digest& digest, int64_t now,
                      Actions& out) {
  if (vote_again(unit, worker, digest, now, out)) return;
  KILN_CHECK(unit->phase != Phase::kFailed);
  if (unit->phase == Phase::kSettled && vote_late(unit, worker, digest, now, out)) return;
  const IdentityId who = worker->identity;
  const auto same = std::find_if(unit->answers.begin(), unit->answers.end(),
                                 [&](const Answer& answer) { return answer.digest == digest; });
  auto answer = static_cast<size_t>(same - unit->answers.begin());
  if (same == unit->answers.end()) {
    answer = units_.add_answer(unit, digest);
    out.push_back(StoreAnswer{worker.id(), trust_.at(who).name, unit.job_id(), unit.id(), unit->shape, digest,
                              unit->answers[answer].ticket});
  } else {
    units_.count(unit.job_id(), &JobCounts::duplicates);
  }
  units_.add_vote(unit, answer, who);
  if (unit->answers[answer].stored)
    out.push_back(Acknowledge{worker.id(), unit.job_id(), unit.id(), digest});
  else
    units_.await_commit(unit, answer, worker.id());
  if (unit->needed == 0) units_.require(unit, needed_votes(unit, who));
  if (unit->answers.size() > 1 && !unit->disputed) dispute(unit, out);
  conclude(unit, now, out);
}

// Two different answers to one unit: a third decides, while the unit's pass is in progress.
void FarmLedger::dispute(const UnitRef& unit, Actions& out) {
  KILN_CHECK(!unit->verified);  // a verified result is not disputed: a differing answer is wrong
  if (unit->phase == Phase::kSettled) units_.reopen(unit);
  units_.require(unit, std::max(unit->needed, 2u));
  if (!unit.of_pass()) {
    if (unit->delivered)
      rewind(
          unit.job_id(),
          text("unit {} of an earlier pass was answered with different bytes by another worker", unit.id()),
          out);
    return;
  }
  units_.dispute(unit);
  out.push_back(Note{
      unit.job_id(),
      text("unit {} was answered with different bytes by different workers: others are asked", unit.id())});
}

void FarmLedger::conclude(const UnitRef& unit, int64_t now, Actions& out) {
  if (unit->phase != Phase::kOpen) return;
  if (unit->needed == 0) return;  // restored: its pass decides how many votes it needs
  const size_t best = units_.leading(*unit);
  if (units_.votes(unit->answers[best]) >= unit->needed) {
    units_.dequeue(unit);
    if (unit->answers[best].stored) settle(unit, best, now, out);
    return;
  }
  if (unit->answers.size() > kMaxDifferentAnswers) {
    out.push_back(FailJob{
        unit.job_id(),
        Error{
            ErrorKind::kInternal,
            text(
                "unit {} was answered by {} workers with as many different results: their builds or machines "
                "do not agree; `kiln why` lists them",
                unit.id(), unit->answers.size())}});
    return;
  }
  if (unit->queue != Queue::kSecond) units_.dequeue(unit);
  units_.enqueue(unit);
  // While unassigned units wait, no worker of the job has room; the next result frees one.
  if (unit->queue == Queue::kSecond && unit.job().pending.empty()) serve_all(unit.job_id(), now, out);
}

// Whose vote its restored answers are is known now: units may have all the votes that they need.
void FarmLedger::count_again(IdentityId who, int64_t now, Actions& out) {
  std::vector<JobId> jobs;
  for (const auto& [id, job] : units_.jobs()) jobs.push_back(id);
  for (const JobId id : jobs) {
    const std::vector<uint64_t> order = units_.at(id).order;
    for (const uint64_t unit_id : order)
      if (const UnitRef unit = units_.find(id, unit_id); units_.voted(*unit, who)) conclude(unit, now, out);
  }
}

void FarmLedger::settle(const UnitRef& unit, size_t winner, int64_t now, Actions& out) {
  const std::vector<Answer> answers = units_.settle(unit, winner);
  const Answer& result = answers[winner];
  grants_.recall_of(unit, out);
  if (unit->verified)
    for (const IdentityId voter : result.voters) trust_.agree(voter, out);
  out.push_back(
      Settle{unit.job_id(), unit.id(), result.digest, unit->verified, trust_.at(result.voters.front()).name});
  if (unit->delivered && unit->merged != result.digest)
    rewind(unit.job_id(), text("unit {} was merged with a result that turned out wrong", unit.id()), out);
  units_.deliver(unit, out);
  for (size_t i = 0; i < answers.size(); ++i) {
    if (i == winner) continue;
    for (const IdentityId voter : answers[i].voters)
      quarantine(voter,
                 text("its answer to unit {} of job {}, {}, differs from {}, which {} others gave", unit.id(),
                      unit.job_id(), answers[i].digest.hex(), result.digest.hex(), units_.votes(result)),
                 now, out);
  }
  units_.complete_if_done(unit.job_id(), out);
}

void FarmLedger::stored(JobId id, uint64_t unit_id, uint64_t ticket, int64_t now, Actions& out) {
  now = time_.advance(now);
  const UnitRef unit = units_.find(id, unit_id);
  Digest digest;
  std::vector<WorkerId> waiting;
  if (!unit || !units_.commit(unit, ticket, digest, waiting)) return;
  for (const WorkerId worker : waiting)
    if (is_member(worker)) out.push_back(Acknowledge{worker, id, unit_id, digest});
  conclude(unit, now, out);
}

void FarmLedger::blame(const UnitRef& unit, const WorkerRef& worker, bool certain, const std::string& reason,
                       Actions& out) {
  if (units_.blame(unit, {worker->identity, worker->traits.process, certain}))
    give_up(unit,
            text("unit {} failed {} times, the last time because {}", unit.id(), unit->failures(), reason),
            out);
}

void FarmLedger::give_up(const UnitRef& unit, const std::string& reason, Actions& out) {
  grants_.recall_of(unit, out);
  units_.fail(unit);
  if (unit.job().traits.poison == PoisonPolicy::kFail) {
    out.push_back(FailJob{unit.job_id(), Error{ErrorKind::kInternal, reason}});
    return;
  }
  out.push_back(SkipUnit{unit.job_id(), unit.id(), reason});
  units_.complete_if_done(unit.job_id(), out);
}

void FarmLedger::unit_failed(WorkerId worker_id, JobId job_id, uint64_t unit_id, const Error& error,
                             int64_t now, Actions& out) {
  now = time_.advance(now);
  const WorkerRef worker = workers_.find(worker_id);
  if (!worker) return;
  hear(worker_id, now, out);
  const UnitRef unit = units_.find(job_id, unit_id);
  const uint64_t lease = unit ? grants_.find(worker_id, *unit) : 0;
  if (!lease) return;  // not its unit to fail
  out.push_back(Note{job_id, text("unit {} failed on {}: {}", unit_id, worker->traits.name, error.message)});
  grants_.release(lease);
  if (error.kind == ErrorKind::kInvalidInput || error.kind == ErrorKind::kUsage) {
    out.push_back(
        FailJob{job_id, Error{error.kind, text("unit {}: {}", unit_id, error.message)}});  // fails everywhere
    return;
  }
  workers_.note_failed(worker, job_id, unit_id);
  blame(unit, worker, true, text("{}: {}", worker->traits.name, error.message), out);
  units_.enqueue(unit);
  bench(worker, now, out);
  serve_all(0, now, out);
}

void FarmLedger::hand_back(WorkerId worker_id, JobId job_id, uint64_t unit_id, int64_t now, Actions& out) {
  now = time_.advance(now);
  const UnitRef unit = units_.find(job_id, unit_id);
  if (!unit || !is_member(worker_id)) return;
  hear(worker_id, now, out);
  grants_.release(grants_.find(worker_id, *unit));
  units_.enqueue(unit);
  serve(worker_id, now, out);
}

void FarmLedger::damaged(JobId id, uint64_t unit_id, int64_t now, Actions& out) {
  now = time_.advance(now);
  const UnitRef unit = units_.find(id, unit_id);
  if (!unit) return;
  const std::string reason = text("the stored result of unit {} is damaged: it is baked again", unit_id);
  if (unit->phase != Phase::kSettled) {
    // In dispute since it was delivered: nobody merged it, and without this nobody would deliver it again.
    if (unit->delivered) rewind(id, reason, out);
    return;
  }
  out.push_back(Revoke{id, unit_id, unit->answers.front().digest});
  rewind(id, reason, out);
  units_.reopen(unit);
  units_.drop_answers(unit);
  serve_all(0, now, out);
}

}  // namespace kiln
