#include <algorithm>
#include <map>

#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {

const char* FarmLedger::voter_word() const {
  return rules_.owners_known ? "owner" : "machine";
}

std::string FarmLedger::why_quorum(const Job& job) const {
  std::set<VoterId> here;
  for (const auto& [id, worker] : workers_)
    if (worker.presence == Presence::kActive) here.insert(identities_[worker.identity].voter);
  std::string words = text("every unit must be answered equally by {} different {}s; {} are here",
                           job.traits.quorum, voter_word(), here.size());
  if (here.size() < job.traits.quorum) words += ": the job waits for others";
  if (!rules_.owners_known)
    words +=
        "; owners cannot be told apart: workers share one token (give them certificates, or each owner a "
        "line NAME TOKEN in the file of worker tokens)";
  return words;
}

std::vector<std::string> FarmLedger::why_job(JobId id, int64_t now) const {
  std::vector<std::string> lines;
  const Job* job = find_job(id);
  if (!job) return {text("job {} is not being baked", id)};
  const JobCounts totals = counts(id);
  lines.push_back(text("it is {} (priority {}): weight {:.2f}; {} used {:.0f} thread-seconds so far",
                       job->traits.user, job->traits.priority, job->weight, job->traits.user,
                       share_.used_ms(job->user) / 1000));
  if (held_) lines.push_back("nothing is handed out: the store cannot write");
  if (job->traits.paused) lines.push_back("it is paused: `kiln resume` lets it go on");
  if (!job->open)
    lines.push_back(job->pass ? "its pass has ended: the coordinator is merging and planning the next pass"
                              : "it has not started: its scene is being prepared");
  if (job->open)
    lines.push_back(
        text("pass {}: {} of {} units done, {} waiting, {} with workers, {} to be answered by another, {} "
             "suspected of breaking workers, {} failed",
             job->pass, job->counts.done, job->counts.units, job->pending.size(), job->leases.size(),
             job->seconds.size(), job->suspects.size(), job->counts.failed));
  lines.push_back(
      text("{} workers with {} threads serve it; {} results verified by another worker, {} not, {} "
           "verifications waived because there was only one machine",
           totals.workers, totals.threads, totals.verified, totals.unverified, totals.waived));
  if (job->disputes)
    lines.push_back(text("{} units have answers that differ: a further worker must decide", job->disputes));
  if (job->traits.quorum > 1) lines.push_back(why_quorum(*job));
  if (const std::string checked = verification_text(verification(id)); !checked.empty())
    lines.push_back(checked);
  uint32_t able = 0, silent = 0, elsewhere = 0;
  for (const auto& [worker_id, worker] : workers_) {
    const auto banned = worker.banned.find(id);
    if (banned != worker.banned.end())
      lines.push_back(text("{} cannot serve it: {}", worker.traits.name, banned->second));
    else if (worker.presence == Presence::kSilent)
      ++silent;
    else if (worker.presence == Presence::kActive)
      ++able, elsewhere += worker.job != 0 && worker.job != id;
  }
  lines.push_back(text("{} workers are present and able, {} of them serve other jobs, {} are silent", able,
                       elsewhere, silent));
  if (elsewhere && totals.workers == 0) {
    for (const auto& [other_id, other] : jobs_) {
      if (other_id == id || !other.open || counts(other_id).workers == 0) continue;
      if (other.traits.user == job->traits.user)
        lines.push_back(text("job {} of the same user is served first: priority {} and older or equal to {}",
                             other_id, other.traits.priority, job->traits.priority));
      else
        lines.push_back(
            text("job {} of {} is served: that user's virtual time is {:.0f}, {}'s {:.0f}; the least is next "
                 "when a worker has stayed {} ms",
                 other_id, other.traits.user, turn(other, 0), job->traits.user, turn(*job, 0),
                 rules_.residence_ms));
    }
  }
  if (able == 0)
    lines.push_back("no worker is present that could: start one with `kiln-worker --connect HOST:PORT`");
  (void)now;
  return lines;
}

std::vector<std::string> FarmLedger::why_unit(JobId id, uint64_t unit_id, int64_t now) const {
  const Job* job = find_job(id);
  if (!job) return {text("job {} is not being baked", id)};
  const auto it = job->units.find(unit_id);
  if (it == job->units.end()) return {text("job {} has no unit {} so far", id, unit_id)};
  const Unit& unit = it->second;
  std::vector<std::string> lines;
  const char* phase = unit.phase == Phase::kSettled  ? "has its result"
                      : unit.phase == Phase::kFailed ? "failed"
                                                     : "is open";
  lines.push_back(text("unit {} {}: pass {}, place {} in its order, weight {:.0f}", unit_id, phase, unit.pass,
                       unit.order, unit.weight));
  if (unit.queue == Queue::kPending)
    lines.push_back(text("it waits: {} units are before it",
                         std::distance(job->pending.begin(), job->pending.find({unit.order, unit_id}))));
  if (unit.queue == Queue::kSuspect)
    lines.push_back(text("it cost {} workers and runs alone on one that it has not cost", unit.attempts));
  if (unit.queue == Queue::kSecond)
    lines.push_back(text("it has been answered; {} equal answers of different {}s are needed", unit.needed,
                         voter_word()));
  for (const uint64_t lease : unit.leases)
    lines.push_back(text("{} has had it for {:.1f} s", workers_.at(leases_.at(lease).worker).traits.name,
                         static_cast<double>(now - leases_.at(lease).since) / 1000));
  for (const Answer& answer : unit.answers) {
    std::string voters;
    for (const IdentityId voter : answer.voters)
      voters += (voters.empty() ? "" : ", ") + identities_[voter].name;
    lines.push_back(text("answer {} by {}: {} of different {}s{}", answer.digest.hex().substr(0, 12), voters,
                         votes(answer), voter_word(), answer.stored ? "" : " (not on disk yet)"));
  }
  for (const IdentityId who : unit.blamed) lines.push_back(text("{} failed it", identities_[who].name));
  return lines;
}

std::vector<std::string> FarmLedger::why_worker(WorkerId id, int64_t now) const {
  const auto it = workers_.find(id);
  if (it == workers_.end()) return {text("worker {} is not connected", id)};
  const Worker& worker = it->second;
  const Identity& identity = identities_[worker.identity];
  std::vector<std::string> lines;
  lines.push_back(text("{}: {} threads, heard {:.1f} s ago", worker.traits.name, worker.traits.threads,
                       static_cast<double>(now - worker.last_heard) / 1000));
  if (identity.quarantined) lines.push_back(text("quarantined: {}", identity.reason));
  if (worker.presence == Presence::kSilent)
    lines.push_back(text("silent for more than {} ms: its units went to others", rules_.lease_ms));
  if (worker.presence == Presence::kDraining) lines.push_back("it is draining: it gets no more units");
  if (now < worker.benched_until)
    lines.push_back(text("it failed several units in a row: none for {:.0f} s more",
                         static_cast<double>(worker.benched_until - now) / 1000));
  if (held_) lines.push_back("nothing is handed out: the store cannot write");
  if (worker.job == 0) {
    lines.push_back("it has no job: none has units that it could take");
    for (const auto& [job_id, job] : jobs_) {
      const auto banned = worker.banned.find(job_id);
      if (banned != worker.banned.end())
        lines.push_back(text("job {}: {}", job_id, banned->second));
      else if (job.traits.paused)
        lines.push_back(text("job {}: paused", job_id));
      else if (!job.open)
        lines.push_back(text("job {}: between passes or being prepared", job_id));
      else
        lines.push_back(
            text("job {}: nothing left to hand out, {} units with workers", job_id, job.leases.size()));
    }
  } else {
    const Job& job = jobs_.at(worker.job);
    lines.push_back(text("it serves job {} of {}{}{}", worker.job, job.traits.user,
                         worker.ready ? "" : ", making its scene ready",
                         worker.leaving ? ", and leaves for another user when its units are done" : ""));
    lines.push_back(text("it holds {} of {} units", worker.held.size(), worker.credits));
    if (worker.ready && worker.held.size() < worker.credits && !job.pending.empty() &&
        would_end_late(worker, job, job.units.at(job.pending.begin()->second).weight, now))
      lines.push_back(
          "it gets no more: at its speed it would end the pass later than the others do without it");
  }
  lines.push_back(
      text("{} of its answers agreed with another worker's; {}", identity.agreed,
           rules_.audit_first == 0 ? "machines are trusted here"
           : identity.agreed < rules_.audit_first
               ? text("until {} did, all are verified", rules_.audit_first)
               : text("{:.1f} % are verified",
                      100 * std::max(rules_.audit_least, 1.0 / static_cast<double>(identity.agreed)))));
  return lines;
}

std::string FarmLedger::audit() const {
  size_t leases = 0;
  for (const auto& [id, job] : jobs_) {
    uint64_t done = 0, failed = 0, pending = 0, suspects = 0, seconds = 0, disputes = 0, verified = 0,
             unverified = 0;
    size_t job_leases = 0;
    for (const auto& [unit_id, unit] : job.units) {
      const bool of_pass = job.open && unit.pass == job.pass;
      done += of_pass && unit.phase == Phase::kSettled;
      failed += of_pass && unit.phase == Phase::kFailed;
      pending += unit.queue == Queue::kPending;
      suspects += unit.queue == Queue::kSuspect;
      seconds += unit.queue == Queue::kSecond;
      disputes += unit.disputed;
      if (unit.phase == Phase::kSettled) ++(unit.verified ? verified : unverified);
      job_leases += unit.leases.size();
      const size_t allowed = std::max(2u, unit.needed);
      if (unit.leases.size() > allowed) return text("unit {} has {} leases", unit_id, unit.leases.size());
      if (unit.phase == Phase::kSettled && (unit.answers.size() != 1 || !unit.answers[0].stored))
        return text("unit {} is settled without an answer on disk", unit_id);
      if (unit.phase != Phase::kOpen && (unit.queue != Queue::kNone || !unit.leases.empty()))
        return text("unit {} has ended but is queued or leased", unit_id);
      const bool forgotten =
          of_pass && unit.phase == Phase::kOpen && unit.queue == Queue::kNone && unit.leases.empty() &&
          unit.unjudged == 0 &&
          std::all_of(unit.answers.begin(), unit.answers.end(), [](const Answer& a) { return a.stored; });
      if (forgotten) {
        std::string why;
        for (const std::string& line : why_unit(id, unit_id, 0)) why += "; " + line;
        return text("unit {} is open, but nobody has it and it does not wait{}", unit_id, why);
      }
    }
    if (job.open && (done != job.counts.done || failed != job.counts.failed))
      return text("job {} counts {} done and {} failed, the table {} and {}", id, job.counts.done,
                  job.counts.failed, done, failed);
    if (pending != job.pending.size() || suspects != job.suspects.size() || seconds != job.seconds.size() ||
        disputes != job.disputes || job_leases != job.leases.size())
      return text("queues of job {} differ from its units", id);
    if (verified + unverified != job.totals.verified + job.totals.unverified ||
        verified != job.totals.verified)
      return text("job {} counts {} verified and {} not, the table {} and {}", id, job.totals.verified,
                  job.totals.unverified, verified, unverified);
    std::set<std::pair<size_t, WorkerId>> backlogs;
    for (const auto& [worker_id, worker] : workers_)
      if (worker.job == id && worker.held.size() > worker.traits.threads)
        backlogs.insert({worker.held.size() - worker.traits.threads, worker_id});
    if (backlogs != job.backlogs) return text("the backlogs of job {} differ from what its workers hold", id);
    leases += job_leases;
  }
  if (leases != leases_.size()) return text("{} leases are counted, {} exist", leases, leases_.size());
  size_t held = 0;
  std::vector<double> threads(share_.size());
  for (const auto& [id, worker] : workers_) {
    held += worker.held.size();
    if (worker.counted_for) threads[*worker.counted_for] += worker.traits.threads;
    if (worker.held.size() > std::max<size_t>(worker.credits, 1))
      return text("worker {} holds more than its credits", id);
    if (!worker.held.empty() && !jobs_.count(worker.job)) return text("worker {} holds units of no job", id);
  }
  if (held != leases_.size()) return text("workers hold {} leases, {} exist", held, leases_.size());
  for (UserId user = 0; user < threads.size(); ++user)
    if (share_.threads(user) != threads[user]) return text("threads of {} are miscounted", share_.name(user));
  return {};
}

}  // namespace kiln
