#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {
namespace {

constexpr size_t kMaxDifferentAnswers = 5;  // of one unit, before the job itself is considered at fault
constexpr double kRateMemory = 0.2;         // weight of the newest result in a worker's rate

}  // namespace

void FarmLedger::result(WorkerId worker_id, JobId job_id, uint64_t unit_id, const Digest& digest, int64_t now,
                        Actions& out) {
  Worker* worker = find_worker(worker_id);
  if (!worker) return;
  heard(worker_id, now, out);
  Job* job = find_job(job_id);
  Unit* unit = job ? find_unit(*job, unit_id) : nullptr;
  if (!unit) {
    out.push_back(Release{worker_id, job_id, "the job has ended"});
    return;
  }
  if (identities_[worker->identity].quarantined) return;
  const auto its_class = worker->classes.find(job_id);
  if (its_class == worker->classes.end()) return;  // it is sent again when the worker is ready for the job
  if (its_class->second != job->traits.numeric_class) {
    if (worker->job != job_id)
      out.push_back(Release{worker_id, job_id, "the job needs another numeric class"});
    return;
  }
  if (const uint64_t lease = lease_of(worker_id, *unit)) {
    const int64_t since = leases_.at(lease).since;
    job->turnaround_ms += static_cast<double>(now - since);
    job->turnaround_weight += unit->weight;
    const double ms = std::max(1.0, static_cast<double>(now - std::max(since, worker->busy_since)));
    const double rate = unit->weight / ms;  // over all its threads, whose results interleave
    worker->rate = worker->rate > 0 ? worker->rate + kRateMemory * (rate - worker->rate) : rate;
    worker->busy_since = now;
    charge(*worker, now);
    release(lease);
  } else if (worker->ghosts > 0) {
    --worker->ghosts;
  }
  worker->failed_units.clear();
  if (unit->phase == Phase::kFailed) {
    out.push_back(Acknowledge{worker_id, job_id, unit_id, digest});
  } else {
    vote(job_id, *job, unit_id, *unit, worker_id, digest, now, out);
    enqueue(*job, unit_id,
            *unit);  // its lease is free now, and the vote may already have counted
  }
  if (find_worker(worker_id)) serve(worker_id, now, out);
}

// The worker's lease of the unit. The lease that a message names does not matter: a claim after a reconnect
// creates a new one.
uint64_t FarmLedger::lease_of(WorkerId worker, const Unit& unit) const {
  for (const uint64_t lease : unit.leases) {
    KILN_CHECK(leases_.count(lease) == 1);
    if (leases_.at(lease).worker == worker) return lease;
  }
  return 0;
}

void FarmLedger::vote(JobId id, Job& job, uint64_t unit_id, Unit& unit, WorkerId worker_id,
                      const Digest& digest, int64_t now, Actions& out) {
  const IdentityId who = workers_.at(worker_id).identity;
  for (Answer& answer : unit.answers) {
    if (std::find(answer.voters.begin(), answer.voters.end(), who) == answer.voters.end()) continue;
    ++job.totals.duplicates;
    if (answer.digest != digest)
      return quarantine(who,
                        text("it answered unit {} of job {} twice with different bytes: {} and {}", unit_id,
                             id, answer.digest.hex(), digest.hex()),
                        now, out);
    if (answer.stored)
      out.push_back(Acknowledge{worker_id, id, unit_id, digest});
    else
      answer.waiting.push_back(worker_id);
    return;
  }
  KILN_CHECK(unit.phase != Phase::kFailed);
  if (unit.phase == Phase::kSettled) {
    KILN_CHECK(unit.answers.size() == 1);
    ++job.totals.duplicates;
    Answer& result = unit.answers.front();
    if (result.digest == digest) {
      const size_t before = votes(result);
      result.voters.push_back(who);
      if (unit.verified && votes(result) > before) agree(who, out);
      if (!unit.verified && votes(result) > 1) {
        for (const IdentityId voter : result.voters) agree(voter, out);
        unit.verified = true;
        KILN_CHECK(job.totals.unverified > 0);
        ++job.totals.verified;
        --job.totals.unverified;
        out.push_back(Settle{id, unit_id, digest, true, identities_[result.voters.front()].name});
      }
      out.push_back(Acknowledge{worker_id, id, unit_id, digest});
      return;
    }
    if (unit.verified)
      return quarantine(who,
                        text("its answer to unit {} of job {}, {}, differs from {}, which two others gave",
                             unit_id, id, digest.hex(), result.digest.hex()),
                        now, out);
    dispute(id, job, unit_id, unit, out);
  }
  auto it = std::find_if(unit.answers.begin(), unit.answers.end(),
                         [&](const Answer& answer) { return answer.digest == digest; });
  if (it == unit.answers.end()) {
    it = unit.answers.insert(unit.answers.end(), Answer{digest, {}, false, next_ticket_++, {}});
    out.push_back(StoreAnswer{worker_id, identities_[who].name, id, unit_id, unit.shape, digest, it->ticket});
  } else {
    ++job.totals.duplicates;
  }
  it->voters.push_back(who);
  if (it->stored)
    out.push_back(Acknowledge{worker_id, id, unit_id, digest});
  else
    it->waiting.push_back(worker_id);
  if (unit.needed == 0) unit.needed = needed_votes(id, job, unit_id, who);
  if (unit.answers.size() > 1 && !unit.disputed) dispute(id, job, unit_id, unit, out);
  conclude(id, job, unit_id, unit, now, out);
}

// Two different answers to one unit: a third decides, while the unit's pass is in progress.
void FarmLedger::dispute(JobId id, Job& job, uint64_t unit_id, Unit& unit, Actions& out) {
  const bool of_pass = job.open && unit.pass == job.pass;
  if (unit.phase == Phase::kSettled) {
    KILN_CHECK(!unit.verified && job.totals.unverified > 0);
    unit.phase = Phase::kOpen;
    --job.totals.unverified;  // a verified result is not disputed: a differing answer is wrong
    if (of_pass) {
      KILN_CHECK(job.counts.done > 0);
      --job.counts.done;
      job.counts.weight_done -= unit.weight;
    }
  }
  unit.needed = std::max(unit.needed, 2u);
  if (!of_pass) {
    if (unit.delivered)
      rewind(id, job,
             text("unit {} of an earlier pass was answered with different bytes by another worker", unit_id),
             out);
    return;
  }
  unit.disputed = true;
  ++job.disputes;
  out.push_back(Note{
      id, text("unit {} was answered with different bytes by different workers: others are asked", unit_id)});
}

void FarmLedger::conclude(JobId id, Job& job, uint64_t unit_id, Unit& unit, int64_t now, Actions& out) {
  if (unit.phase != Phase::kOpen || unit.answers.empty()) return;
  size_t best = 0;
  for (size_t i = 1; i < unit.answers.size(); ++i)
    if (votes(unit.answers[i]) > votes(unit.answers[best])) best = i;
  if (votes(unit.answers[best]) >= unit.needed) {
    dequeue(job, unit_id, unit);
    if (unit.answers[best].stored) settle(id, job, unit_id, unit, best, now, out);
    return;
  }
  if (unit.answers.size() > kMaxDifferentAnswers) {
    out.push_back(FailJob{
        id,
        Error{
            ErrorKind::kInternal,
            text(
                "unit {} was answered by {} workers with as many different results: their builds or machines "
                "do not agree; `kiln why` lists them",
                unit_id, unit.answers.size())}});
    return;
  }
  if (unit.queue != Queue::kSecond) dequeue(job, unit_id, unit);
  enqueue(job, unit_id, unit);
  // While unassigned units wait, no worker of the job has room; the next result frees one.
  if (unit.queue == Queue::kSecond && job.pending.empty()) serve_all(id, now, out);
}

// Whose vote its restored answers are is known now: units may have all the votes that they need.
void FarmLedger::count_again(IdentityId who, int64_t now, Actions& out) {
  for (auto& [id, job] : jobs_) {
    const std::vector<uint64_t> order = job.order;
    for (const uint64_t unit_id : order)
      if (Unit* unit = find_unit(job, unit_id); unit && voted(*unit, who))
        conclude(id, job, unit_id, *unit, now, out);
  }
}

void FarmLedger::settle(JobId id, Job& job, uint64_t unit_id, Unit& unit, size_t winner, int64_t now,
                        Actions& out) {
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
  const std::vector<uint64_t> leases = unit.leases;
  for (const uint64_t lease : leases) {
    out.push_back(Recall{leases_.at(lease).worker, id, unit_id});
    release(lease);
  }
  if (unit.verified)
    for (const IdentityId voter : answers[winner].voters) agree(voter, out);
  out.push_back(Settle{id, unit_id, answers[winner].digest, unit.verified,
                       identities_[answers[winner].voters.front()].name});
  if (unit.delivered && unit.merged != answers[winner].digest)
    rewind(id, job, text("unit {} was merged with a result that turned out wrong", unit_id), out);
  deliver(id, job, unit_id, unit, out);
  for (size_t i = 0; i < answers.size(); ++i) {
    if (i == winner) continue;
    for (const IdentityId voter : answers[i].voters)
      quarantine(voter,
                 text("its answer to unit {} of job {}, {}, differs from {}, which {} others gave", unit_id,
                      id, answers[i].digest.hex(), answers[winner].digest.hex(), votes(answers[winner])),
                 now, out);
  }
  complete_if_done(id, job, out);
}

void FarmLedger::stored(JobId id, uint64_t unit_id, uint64_t ticket, int64_t now, Actions& out) {
  Job* job = find_job(id);
  Unit* unit = job ? find_unit(*job, unit_id) : nullptr;
  if (!unit) return;
  for (Answer& answer : unit->answers) {
    if (answer.ticket != ticket) continue;
    answer.stored = true;
    for (const WorkerId worker : answer.waiting)
      if (workers_.count(worker)) out.push_back(Acknowledge{worker, id, unit_id, answer.digest});
    answer.waiting.clear();
    return conclude(id, *job, unit_id, *unit, now, out);
  }
}

void FarmLedger::blame(JobId id, Job& job, uint64_t unit_id, Unit& unit, IdentityId who, bool certain,
                       const std::string& reason, Actions& out) {
  if (unit.phase != Phase::kOpen || !unit.answers.empty()) return;
  if (std::find(unit.blamed.begin(), unit.blamed.end(), who) == unit.blamed.end()) unit.blamed.push_back(who);
  dequeue(job, unit_id, unit);
  ++unit.attempts;
  job.suspected = true;
  if (certain && ++unit.failures >= rules_.max_attempts)
    give_up(id, job, unit_id, unit,
            text("unit {} failed {} times, the last time because {}", unit_id, unit.failures, reason), out);
}

void FarmLedger::give_up(JobId id, Job& job, uint64_t unit_id, Unit& unit, const std::string& reason,
                         Actions& out) {
  KILN_CHECK(unit.phase == Phase::kOpen && unit.answers.empty());
  unit.phase = Phase::kFailed;
  const std::vector<uint64_t> leases = unit.leases;
  for (const uint64_t lease : leases) {
    out.push_back(Recall{leases_.at(lease).worker, id, unit_id});
    release(lease);
  }
  if (job.open && unit.pass == job.pass) ++job.counts.failed;
  if (job.traits.poison == PoisonPolicy::kFail) {
    out.push_back(FailJob{id, Error{ErrorKind::kInternal, reason}});
    return;
  }
  out.push_back(SkipUnit{id, unit_id, reason});
  complete_if_done(id, job, out);
}

void FarmLedger::unit_failed(WorkerId worker_id, JobId job_id, uint64_t unit_id, const Error& error,
                             int64_t now, Actions& out) {
  Worker* worker = find_worker(worker_id);
  if (!worker) return;
  heard(worker_id, now, out);
  Job* found = find_job(job_id);
  Unit* failed = found ? find_unit(*found, unit_id) : nullptr;
  const uint64_t lease = failed ? lease_of(worker_id, *failed) : 0;
  if (!lease) return;  // not its unit to fail
  Job& job = *found;
  Unit& unit = *failed;
  out.push_back(Note{job_id, text("unit {} failed on {}: {}", unit_id, worker->traits.name, error.message)});
  release(lease);
  if (error.kind == ErrorKind::kInvalidInput || error.kind == ErrorKind::kUsage) {
    out.push_back(
        FailJob{job_id, Error{error.kind, text("unit {}: {}", unit_id, error.message)}});  // fails everywhere
    return;
  }
  worker->failed_units.insert(unit_id);
  blame(job_id, job, unit_id, unit, worker->identity, true,
        text("{}: {}", worker->traits.name, error.message), out);
  enqueue(job, unit_id, unit);
  bench(worker_id, *worker, now, out);
  serve_all(0, now, out);
}

void FarmLedger::hand_back(WorkerId worker_id, JobId job_id, uint64_t unit_id, int64_t now, Actions& out) {
  Job* job = find_job(job_id);
  Unit* unit = job ? find_unit(*job, unit_id) : nullptr;
  if (!unit || !find_worker(worker_id)) return;
  heard(worker_id, now, out);
  release(lease_of(worker_id, *unit));
  enqueue(*job, unit_id, *unit);
  serve(worker_id, now, out);
}

void FarmLedger::damaged(JobId id, uint64_t unit_id, int64_t now, Actions& out) {
  Job* job = find_job(id);
  Unit* unit = job ? find_unit(*job, unit_id) : nullptr;
  if (!unit) return;
  const std::string reason = text("the stored result of unit {} is damaged: it is baked again", unit_id);
  if (unit->phase != Phase::kSettled) {
    // In dispute since it was delivered: nobody merged it, and without this nobody would deliver it again.
    if (unit->delivered) rewind(id, *job, reason, out);
    return;
  }
  KILN_CHECK(unit->answers.size() == 1);
  KILN_CHECK((unit->verified ? job->totals.verified : job->totals.unverified) > 0);
  --(unit->verified ? job->totals.verified : job->totals.unverified);
  out.push_back(Revoke{id, unit_id, unit->answers.front().digest});
  unit->answers.clear();
  unit->phase = Phase::kOpen;
  unit->needed = 0;
  unit->verified = false;
  rewind(id, *job, reason, out);
  serve_all(0, now, out);
}

}  // namespace kiln
