#include <algorithm>
#include <map>

#include "common/base/format.h"
#include "coordinator/farm/ledger/farm_ledger.h"

namespace kiln {

const char* FarmLedger::voter_word() const {
  return rules_.owners_known ? "owner" : "machine";
}

std::string FarmLedger::why_quorum(const UnitTable::Job& job) const {
  std::set<VoterId> here;
  for (const auto& [id, worker] : workers_.all())
    if (worker.presence == Presence::kActive) here.insert(trust_.at(worker.identity).voter);
  std::string words = text("every unit must be answered equally by {} different {}s; {} are here",
                           job.traits.quorum, voter_word(), here.size());
  if (here.size() < job.traits.quorum) words += ": the job waits for others";
  if (!rules_.owners_known)
    words +=
        "; owners cannot be told apart: workers share one token (give them certificates, or each owner a "
        "line NAME TOKEN in the file of worker tokens)";
  return words;
}

// Workers are here, but serve other jobs.
void FarmLedger::why_elsewhere(JobId id, std::vector<std::string>& lines) const {
  const UnitTable::Job& job = units_.at(id);
  for (const auto& [other_id, other] : units_.jobs()) {
    if (other_id == id || !other.open || counts(other_id).workers == 0) continue;
    if (other.traits.user == job.traits.user)
      lines.push_back(text("job {} of the same user is served first: priority {} and older or equal to {}",
                           other_id, other.traits.priority, job.traits.priority));
    else
      lines.push_back(
          text("job {} of {} is served: that user's virtual time is {:.0f}, {}'s {:.0f}; the least is next "
               "when a worker has stayed {} ms",
               other_id, other.traits.user, grants_.turn(other, 0), job.traits.user, grants_.turn(job, 0),
               rules_.residence_ms));
  }
}

std::vector<std::string> FarmLedger::why_job(JobId id, int64_t now) const {
  std::vector<std::string> lines;
  const UnitTable::Job* job = units_.find(id);
  if (!job) return {text("job {} is not being baked", id)};
  const JobCounts totals = counts(id);
  lines.push_back(text("it is {} (priority {}): weight {:.2f}; {} used {:.0f} thread-seconds so far",
                       job->traits.user, job->traits.priority, job->weight, job->traits.user,
                       workers_.share().used_ms(job->user) / 1000));
  if (held_) lines.push_back("nothing is handed out: the store cannot write");
  if (job->traits.paused) lines.push_back("it is paused: `kiln resume` lets it go on");
  if (!job->open)
    lines.push_back(job->pass ? "its pass has ended: the coordinator is merging and planning the next pass"
                              : "it has not started: its scene is being prepared");
  if (job->open)
    lines.push_back(
        text("pass {}: {} of {} units done, {} waiting, {} with workers, {} to be answered by another, {} "
             "suspected of breaking workers, {} failed",
             job->pass, job->counts.done, job->counts.units, job->pending.size(), grants_.count(id),
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
  for (const auto& [worker_id, worker] : workers_.all()) {
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
  if (elsewhere && totals.workers == 0) why_elsewhere(id, lines);
  if (able == 0)
    lines.push_back("no worker is present that could: start one with `kiln-worker --connect HOST:PORT`");
  (void)now;
  return lines;
}

std::vector<std::string> FarmLedger::why_unit(JobId id, uint64_t unit_id, int64_t now) const {
  now = time_.at(now);
  const UnitTable::Job* job = units_.find(id);
  if (!job) return {text("job {} is not being baked", id)};
  const auto it = job->units.find(unit_id);
  if (it == job->units.end()) return {text("job {} has no unit {} so far", id, unit_id)};
  const UnitTable::Unit& unit = it->second;
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
    lines.push_back(
        text("it cost {} workers and runs alone on one that it has not cost", unit.blamed.size()));
  if (unit.queue == Queue::kSecond)
    lines.push_back(text("it has been answered; {} equal answers of different {}s are needed", unit.needed,
                         voter_word()));
  for (const uint64_t lease : unit.leases.all())
    lines.push_back(text("{} has had it for {:.1f} s", grants_.at(lease).worker->traits.name,
                         static_cast<double>(now - grants_.at(lease).since) / 1000));
  for (const Answer& answer : unit.answers) {
    std::string voters;
    for (const IdentityId voter : answer.voters)
      voters += (voters.empty() ? "" : ", ") + trust_.at(voter).name;
    lines.push_back(text("answer {} by {}: {} of different {}s{}", answer.digest.hex().substr(0, 12), voters,
                         units_.votes(answer), voter_word(), answer.stored ? "" : " (not on disk yet)"));
  }
  for (const UnitTable::Blame& blame : unit.blamed)
    lines.push_back(text("{} failed it", trust_.at(blame.who).name));
  return lines;
}

void FarmLedger::why_idle(std::vector<std::string>& lines, const WorkerTable::Worker& worker) const {
  lines.push_back("it has no job: none has units that it could take");
  for (const auto& [job_id, job] : units_.jobs()) {
    const auto banned = worker.banned.find(job_id);
    if (banned != worker.banned.end())
      lines.push_back(text("job {}: {}", job_id, banned->second));
    else if (job.traits.paused)
      lines.push_back(text("job {}: paused", job_id));
    else if (!job.open)
      lines.push_back(text("job {}: between passes or being prepared", job_id));
    else
      lines.push_back(
          text("job {}: nothing left to hand out, {} units with workers", job_id, grants_.count(job_id)));
  }
}

std::vector<std::string> FarmLedger::why_worker(WorkerId id, int64_t now) const {
  now = time_.at(now);
  const WorkerTable::Worker* found = workers_.find(id);
  if (!found) return {text("worker {} is not connected", id)};
  const WorkerTable::Worker& worker = *found;
  const TrustTable::Identity& identity = trust_.at(worker.identity);
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
    why_idle(lines, worker);
  } else {
    const UnitTable::Job& job = units_.at(worker.job);
    lines.push_back(text("it serves job {} of {}{}{}", worker.job, job.traits.user,
                         worker.ready ? "" : ", making its scene ready",
                         worker.leaving ? ", and leaves for another user when its units are done" : ""));
    lines.push_back(text("it holds {} of {} units", worker.leases.size(), worker.credits));
    if (worker.ready && worker.leases.size() < worker.credits && !job.pending.empty() &&
        grants_.would_end_late(worker, job.units.at(job.pending.begin()->second).weight, now))
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
  for (std::string wrong : {trust_.audit(), units_.audit(), workers_.audit(), grants_.audit()})
    if (!wrong.empty()) return wrong;
  return {};
}

}  // namespace kiln
