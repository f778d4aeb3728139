#include "coordinator/farm/ledger/unit_table.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {

// Jobs

void UnitTable::add_job(JobId id, const JobTraits& traits, UserId user) {
  KILN_CHECK(id != 0 && !jobs_.count(id));
  Job& job = jobs_[id];
  job.traits = traits;
  job.user = user;
  job.weight = FairShare::weight(traits.priority);
}

UnitTable::Job& UnitTable::edit(JobId id) {
  const auto it = jobs_.find(id);
  KILN_CHECK(it != jobs_.end());
  return it->second;
}

void UnitTable::change_job(JobId id, int32_t priority, bool paused) {
  Job& job = edit(id);
  job.traits.priority = priority;
  job.traits.paused = paused;
  job.weight = FairShare::weight(priority);
}

void UnitTable::pin_class(JobId id, const std::string& numeric_class) {
  edit(id).traits.numeric_class = numeric_class;
}

const UnitTable::Job* UnitTable::find(JobId id) const {
  const auto it = jobs_.find(id);
  return it == jobs_.end() ? nullptr : &it->second;
}

const UnitTable::Job& UnitTable::at(JobId id) const {
  const Job* job = find(id);
  KILN_CHECK(job);
  return *job;
}

void UnitTable::count(JobId id, uint64_t JobCounts::*what) {
  KILN_CHECK(what != &JobCounts::verified && what != &JobCounts::unverified && what != &JobCounts::disputes);
  ++(edit(id).totals.*what);
}

Verification UnitTable::verification(JobId id) const {
  Verification v;
  const Job* job = find(id);
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
    contribution.identity = trust_.at(who).name;
    v.by.push_back(std::move(contribution));
  }
  std::sort(v.by.begin(), v.by.end(), [](const auto& a, const auto& b) { return a.identity < b.identity; });
  return v;
}

// Units

UnitTable::Ref UnitTable::find(JobId job_id, uint64_t unit_id) {
  const auto job = jobs_.find(job_id);
  if (job == jobs_.end()) return {};
  const auto unit = job->second.units.find(unit_id);
  if (unit == job->second.units.end()) return {};
  return Ref(job_id, unit_id, job->second, unit->second);
}

UnitTable::Ref UnitTable::find_or_add(JobId job_id, uint64_t unit_id) {
  Job& job = edit(job_id);
  return Ref(job_id, unit_id, job, job.units[unit_id]);
}

void UnitTable::enqueue(const Ref& ref) {
  Job& job = *ref.job_;
  Unit& unit = *ref.unit_;
  if (unit.phase != Phase::kOpen || unit.queue != Queue::kNone) return;
  const size_t most = most_votes(unit);
  if (most > 0) {
    // As many other voters as are missing must answer too.
    if (most >= unit.needed || unit.leases.size() + most >= unit.needed) return;
    if (!ref.of_pass() && !unit.disputed) return;
    unit.queue = Queue::kSecond;
    job.seconds.insert(ref.id_);
  } else if (ref.of_pass() && unit.leases.empty()) {
    // It waits for a verdict rather than crash another worker.
    if (unit.unjudged > 0 && unit.failures() + unit.unjudged >= rules_.max_attempts) return;
    unit.queue = unit.suspect() ? Queue::kSuspect : Queue::kPending;
    if (unit.suspect())
      job.suspects.insert(ref.id_);
    else
      job.pending.insert({unit.order, ref.id_});
  }
}

void UnitTable::dequeue(const Ref& ref) {
  Job& job = *ref.job_;
  Unit& unit = *ref.unit_;
  size_t left = 1;
  if (unit.queue == Queue::kPending) left = job.pending.erase({unit.order, ref.id_});
  if (unit.queue == Queue::kSuspect) left = job.suspects.erase(ref.id_);
  if (unit.queue == Queue::kSecond) left = job.seconds.erase(ref.id_);
  KILN_CHECK(left == 1);
  unit.queue = Queue::kNone;
}

// Passes

void UnitTable::open_pass(JobId id) {
  Job& job = edit(id);
  KILN_CHECK(!job.open);
  job.open = true;
  ++job.pass;
  job.order.clear();
  job.counts = {};
  job.counts.number = job.pass;
}

void UnitTable::place(const Ref& ref, const UnitPlan& plan) {
  Job& job = *ref.job_;
  Unit& unit = *ref.unit_;
  KILN_CHECK(plan.id != 0 && unit.pass != job.pass);  // ids are unique in a pass
  unit.shape = plan.shape;
  unit.weight = plan.weight;
  unit.pass = job.pass;
  unit.order = static_cast<uint32_t>(job.order.size());
  unit.delivered = false;
  if (unit.phase == Phase::kFailed) unit.phase = Phase::kOpen;
  job.order.push_back(plan.id);
  ++job.counts.units;
  job.counts.weight += plan.weight;
}

void UnitTable::forget(const Ref& ref) {
  Job& job = *ref.job_;
  Unit& unit = *ref.unit_;
  KILN_CHECK(unit.leases.empty());
  dequeue(ref);
  if (unit.disputed) --job.disputes;
  if (unit.phase == Phase::kSettled) --(unit.verified ? job.totals.verified : job.totals.unverified);
  std::erase_if(losses_, [&](const Loss& loss) { return loss.job == ref.job_id_ && loss.unit == ref.id_; });
  unit = {};
}

void UnitTable::deliver(const Ref& ref, Actions& out) {
  Job& job = *ref.job_;
  Unit& unit = *ref.unit_;
  if (!ref.of_pass()) return;
  KILN_CHECK(unit.phase == Phase::kSettled && unit.answers.size() == 1);
  KILN_CHECK(job.counts.done < job.counts.units);
  ++job.counts.done;
  job.counts.weight_done += unit.weight;
  if (unit.delivered) return;  // before a dispute that it won
  unit.delivered = true;
  unit.merged = unit.answers.front().digest;
  out.push_back(Deliver{ref.job_id_, ref.id_, unit.answers.front().digest});
}

void UnitTable::complete_if_done(JobId id, Actions& out) {
  Job& job = edit(id);
  if (!job.open || job.disputes > 0 || job.counts.done + job.counts.failed < job.counts.units) return;
  KILN_CHECK(job.counts.done + job.counts.failed == job.counts.units);
  KILN_CHECK(job.pending.empty() && job.suspects.empty());
  job.open = false;
  out.push_back(PassComplete{id});
}

void UnitTable::abandon_pass(JobId id) {
  for (const uint64_t unit : edit(id).order) dequeue(find(id, unit));
  close_pass(id);
}

void UnitTable::reset_passes(JobId id) {
  Job& job = edit(id);
  for (auto& [unit_id, unit] : job.units) {
    dequeue(Ref(id, unit_id, job, unit));
    unit.delivered = unit.disputed = false;
  }
  job.disputes = 0;
}

void UnitTable::start_over(JobId id, const std::string& numeric_class, Actions& out) {
  Job& job = edit(id);
  std::vector<uint64_t> units;
  for (const auto& [unit_id, unit] : job.units) units.push_back(unit_id);
  std::sort(units.begin(), units.end());
  for (const uint64_t unit_id : units) {
    const Ref ref = find(id, unit_id);
    KILN_CHECK(ref->leases.empty());
    dequeue(ref);
    for (const Answer& answer : ref->answers) out.push_back(Revoke{id, unit_id, answer.digest});
  }
  std::erase_if(losses_, [&](const Loss& loss) { return loss.job == id; });
  job.units.clear();
  job.order.clear();
  job.disputes = 0;
  job.totals.verified = job.totals.unverified = 0;
  job.traits.numeric_class = numeric_class;
}

// Failures

uint32_t UnitTable::Unit::failures() const {
  return static_cast<uint32_t>(
      std::count_if(blamed.begin(), blamed.end(), [](const Blame& b) { return b.certain; }));
}

bool UnitTable::blame(const Ref& ref, const Blame& blame) {
  Unit& unit = *ref.unit_;
  KILN_CHECK(unit.phase == Phase::kOpen);  // a unit that has ended is with nobody
  if (!unit.answers.empty()) return false;
  dequeue(ref);
  unit.blamed.push_back(blame);
  ref.job_->suspected = true;
  return blame.certain && unit.failures() >= rules_.max_attempts;
}

void UnitTable::absolve(const Ref& ref, IdentityId who) {
  Unit& unit = *ref.unit_;
  if (std::erase_if(unit.blamed, [&](const Blame& b) { return b.who == who; }) == 0) return;
  dequeue(ref);
  enqueue(ref);
}

void UnitTable::fail(const Ref& ref) {
  KILN_CHECK(ref->phase == Phase::kOpen && ref->answers.empty() && ref->leases.empty());
  ref.unit_->phase = Phase::kFailed;
  if (ref.of_pass()) ++ref.job_->counts.failed;
}

void UnitTable::note_loss(const Ref& ref, Loss loss) {
  KILN_CHECK(loss.job == ref.job_id_ && loss.unit == ref.id_);
  blame(ref, {loss.identity, loss.process, false});
  ref.unit_->unjudged += loss.certain;
  losses_.push_back(std::move(loss));
}

void UnitTable::forgive_losses(uint64_t process) {
  for (const Loss& loss : losses_) {
    const Ref ref = loss.process == process ? find(loss.job, loss.unit) : Ref{};
    if (!ref) continue;
    Unit& unit = *ref.unit_;
    KILN_CHECK(!loss.certain || unit.unjudged > 0);
    unit.unjudged -= loss.certain;
    std::erase_if(unit.blamed, [&](const Blame& b) { return b.process == process && !b.certain; });
    if (unit.queue == Queue::kSuspect) dequeue(ref);
    enqueue(ref);
  }
  std::erase_if(losses_, [&](const Loss& loss) { return loss.process == process; });
}

// True: the unit has certainly failed too often.
bool UnitTable::judge(const Loss& loss) {
  const Ref ref = loss.certain ? find(loss.job, loss.unit) : Ref{};
  if (!ref) return false;
  Unit& unit = *ref.unit_;
  KILN_CHECK(unit.unjudged > 0);
  --unit.unjudged;
  if (unit.phase != Phase::kOpen || !unit.answers.empty()) return false;
  for (Blame& b : unit.blamed) b.certain |= b.process == loss.process;
  if (unit.failures() < rules_.max_attempts) {
    enqueue(ref);
    return false;
  }
  dequeue(ref);
  return true;
}

// Invariant

std::string UnitTable::audit_unit(const Job& job, uint64_t id, const Unit& unit) const {
  const bool of_pass = job.open && unit.pass == job.pass;
  if (unit.leases.size() > std::max(2u, unit.needed))
    return text("unit {} has {} leases", id, unit.leases.size());
  if (unit.phase == Phase::kSettled && (unit.answers.size() != 1 || !unit.answers[0].stored))
    return text("unit {} is settled without an answer on disk", id);
  if (unit.phase == Phase::kFailed && !unit.answers.empty())
    return text("unit {} failed and has an answer", id);
  if (unit.phase != Phase::kOpen && (unit.queue != Queue::kNone || !unit.leases.empty()))
    return text("unit {} has ended but is queued or leased", id);
  if (job.pending.count({unit.order, id}) != (unit.queue == Queue::kPending) ||
      job.suspects.count(id) != (unit.queue == Queue::kSuspect) ||
      job.seconds.count(id) != (unit.queue == Queue::kSecond))
    return text("unit {} does not wait in the queue that it names", id);
  for (size_t i = 0; i < unit.answers.size(); ++i) {
    if (unit.answers[i].voters.empty()) return text("an answer to unit {} is nobody's", id);
    for (size_t k = 0; k < i; ++k)
      if (unit.answers[i].digest == unit.answers[k].digest)
        return text("unit {} has the same answer twice", id);
  }
  const bool forgotten =
      of_pass && unit.phase == Phase::kOpen && unit.queue == Queue::kNone && unit.leases.empty() &&
      unit.unjudged == 0 &&
      std::all_of(unit.answers.begin(), unit.answers.end(), [](const Answer& a) { return a.stored; });
  if (forgotten) return text("unit {} is open, but nobody has it and it does not wait", id);
  return {};
}

std::string UnitTable::audit_job(JobId id, const Job& job) const {
  uint64_t done = 0, failed = 0, pending = 0, suspects = 0, seconds = 0, disputes = 0, verified = 0,
           unverified = 0;
  for (const auto& [unit_id, unit] : job.units) {
    if (std::string wrong = audit_unit(job, unit_id, unit); !wrong.empty()) return wrong;
    const bool of_pass = job.open && unit.pass == job.pass;
    done += of_pass && unit.phase == Phase::kSettled;
    failed += of_pass && unit.phase == Phase::kFailed;
    pending += unit.queue == Queue::kPending;
    suspects += unit.queue == Queue::kSuspect;
    seconds += unit.queue == Queue::kSecond;
    disputes += unit.disputed;
    if (unit.phase == Phase::kSettled) ++(unit.verified ? verified : unverified);
  }
  if (job.open && (done != job.counts.done || failed != job.counts.failed))
    return text("job {} counts {} done and {} failed, the table {} and {}", id, job.counts.done,
                job.counts.failed, done, failed);
  if (job.open && job.order.size() != job.counts.units)
    return text("the pass of job {} has {} units and counts {}", id, job.order.size(), job.counts.units);
  if (pending != job.pending.size() || suspects != job.suspects.size() || seconds != job.seconds.size() ||
      disputes != job.disputes)
    return text("queues of job {} differ from its units", id);
  if (verified != job.totals.verified || unverified != job.totals.unverified)
    return text("job {} counts {} verified and {} not, the table {} and {}", id, job.totals.verified,
                job.totals.unverified, verified, unverified);
  return {};
}

std::string UnitTable::audit() const {
  for (const auto& [id, job] : jobs_)
    if (std::string wrong = audit_job(id, job); !wrong.empty()) return wrong;
  std::map<std::pair<JobId, uint64_t>, uint32_t> unjudged;
  for (const Loss& loss : losses_)
    if (loss.certain) ++unjudged[{loss.job, loss.unit}];
  for (const auto& [id, job] : jobs_)
    for (const auto& [unit_id, unit] : job.units) {
      const auto known = unjudged.find({id, unit_id});
      if (unit.unjudged != (known == unjudged.end() ? 0 : known->second))
        return text("unit {} of job {} awaits {} verdicts, but other losses are known", unit_id, id,
                    unit.unjudged);
    }
  return {};
}

}  // namespace kiln
