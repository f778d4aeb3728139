// The farm's jobs and their units: passes, queues, answers, and losses that units may have caused.
//
// Invariant: every unit of an open pass has ended (settled by one answer on disk, or failed), or it waits in
// exactly the queue that it names, is leased, is being written or awaits a verdict; and a job's counters are
// what its units add up to.
#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "coordinator/farm/ledger/counts.h"
#include "coordinator/farm/ledger/fair_share.h"
#include "coordinator/farm/ledger/leases.h"
#include "coordinator/farm/ledger/trust_table.h"
#include "coordinator/farm/ledger/verification.h"

namespace kiln {

class UnitTable {
 public:
  struct Answer {
    Digest digest;
    std::vector<IdentityId> voters;
    bool stored = false;
    uint64_t ticket = 0;  // identifies the write; the same bytes may be written, revoked and written again
    std::vector<WorkerId> waiting;  // for an acknowledgement
  };
  struct Blame {  // the unit cost this worker, or failed on it
    IdentityId who;
    uint64_t process;
    bool certain;  // false: its connection was lost, which may have had another reason
  };
  enum class Phase : uint8_t { kOpen, kSettled, kFailed };
  enum class Queue : uint8_t { kNone, kPending, kSuspect, kSecond };
  struct Unit {
    uint64_t shape = 0;
    double weight = 1;
    uint32_t pass = 0;      // the last pass that requested it
    uint32_t order = 0;     // in that pass
    uint32_t needed = 0;    // equal votes needed; 0: undecided
    uint32_t unjudged = 0;  // losses of workers that held nothing else and may still come back
    Phase phase = Phase::kOpen;
    Queue queue = Queue::kNone;
    bool verified = false, delivered = false, copied = false, disputed = false;
    UnitLeases leases;
    std::vector<Answer> answers;  // settled unit: only its result, with its voters
    std::vector<Blame> blamed;    // of an attempt each; any makes it a suspect
    Digest merged;                // of a delivered unit
    bool suspect() const { return !blamed.empty(); }
    uint32_t failures() const;  // that the unit certainly caused
  };
  struct Job {
    JobTraits traits;
    UserId user = 0;
    double weight = 1;  // of its priority
    bool open = false;  // a pass is in progress
    uint32_t pass = 0;
    std::unordered_map<uint64_t, Unit> units;
    std::vector<uint64_t> order;                      // units of the pass
    std::set<std::pair<uint32_t, uint64_t>> pending;  // (order, unit)
    std::set<uint64_t> suspects, seconds;
    bool suspected = false;  // some unit has cost a worker
    PassCounts counts;
    JobCounts totals;
    uint32_t disputes = 0;
  };
  // A unit of a job. It can be read through this, and changed by the table. Valid until the job ends.
  class Ref {
   public:
    Ref() = default;
    explicit operator bool() const { return unit_ != nullptr; }
    const Unit* operator->() const { return unit_; }
    const Unit& operator*() const { return *unit_; }
    JobId job_id() const { return job_id_; }
    const Job& job() const { return *job_; }
    uint64_t id() const { return id_; }
    UnitLeases& leases() const { return unit_->leases; }
    bool of_pass() const { return job_->open && unit_->pass == job_->pass; }

   private:
    friend class UnitTable;
    Ref(JobId job_id, uint64_t id, Job& job, Unit& unit)
        : job_id_(job_id), id_(id), job_(&job), unit_(&unit) {}
    JobId job_id_ = 0;
    uint64_t id_ = 0;
    Job* job_ = nullptr;
    Unit* unit_ = nullptr;
  };
  struct Loss {  // a lost connection: a crash, unless the process comes back
    uint64_t process;
    IdentityId identity;
    int64_t when;
    bool certain;  // the worker held nothing else
    JobId job;
    uint64_t unit;
    std::string reason;
  };
  struct Purged {  // what a quarantine took from a job
    std::vector<uint64_t> units;
    uint64_t revoked = 0;  // settled results
    bool merged = false;   // some of them
  };

  UnitTable(const FarmRules& rules, const TrustTable& trust) : rules_(rules), trust_(trust) {}

  // Jobs
  void add_job(JobId id, const JobTraits& traits, UserId user);
  void end_job(JobId id) { jobs_.erase(id); }
  void change_job(JobId id, int32_t priority, bool paused);
  void pin_class(JobId id, const std::string& numeric_class);
  const Job* find(JobId id) const;
  const Job& at(JobId id) const;
  const std::map<JobId, Job>& jobs() const { return jobs_; }
  // Counts one more duplicate, copy, reassigned unit, lost worker or waived verification.
  void count(JobId id, uint64_t JobCounts::*what);
  Verification verification(JobId id) const;

  // Units
  Ref find(JobId job, uint64_t unit);
  Ref find_or_add(JobId job, uint64_t unit);
  // The queue in which the unit must wait, if any.
  void enqueue(const Ref& unit);
  void dequeue(const Ref& unit);
  void mark_copied(const Ref& unit) { unit.unit_->copied = true; }
  void require(const Ref& unit, uint32_t votes) { unit.unit_->needed = votes; }

  // Passes. The leases of units that leave the queues for good are the caller's to end, before.
  void open_pass(JobId id);
  void place(const Ref& unit, const UnitPlan& plan);
  void forget(const Ref& unit);  // everything about it
  void deliver(const Ref& unit, Actions& out);
  void complete_if_done(JobId id, Actions& out);
  void close_pass(JobId id) { edit(id).open = false; }
  void abandon_pass(JobId id);
  void reset_passes(JobId id);  // nothing is queued, delivered or disputed any more
  void start_over(JobId id, const std::string& numeric_class, Actions& out);  // without any answers

  // Answers
  void restore(JobId id, const KnownAnswer& known, IdentityId who);
  size_t votes(const Answer& answer) const { return trust_.votes(answer.voters); }
  size_t most_votes(const Unit& unit) const;
  size_t leading(const Unit& unit) const;  // index of the first answer with most votes; there is one
  bool voted(const Unit& unit, IdentityId who) const;
  size_t add_answer(const Ref& unit, const Digest& digest);  // its index
  void add_vote(const Ref& unit, size_t answer, IdentityId who);
  void await_commit(const Ref& unit, size_t answer, WorkerId worker);
  // The answer with this ticket is on disk: who waits for that. False: there is none.
  bool commit(const Ref& unit, uint64_t ticket, Digest& digest, std::vector<WorkerId>& waiting);
  // The answer becomes the unit's result. All answers of before, the result at `winner`.
  std::vector<Answer> settle(const Ref& unit, size_t winner);
  void confirm(const Ref& unit);  // the result of a settled unit is verified now
  void reopen(const Ref& unit);   // its result is none any more
  void drop_answers(const Ref& unit);
  void dispute(const Ref& unit);
  void resolve_if_one_answer(const Ref& unit);  // a dispute between answers of which one is left
  // Takes back what this identity alone said.
  Purged purge(JobId id, IdentityId who, Actions& out);

  // Failures
  // The unit may have cost a worker or failed on it. True: it has now certainly failed too often.
  bool blame(const Ref& unit, const Blame& blame);
  void absolve(const Ref& unit, IdentityId who);  // of all that it did to this identity
  void fail(const Ref& unit);
  void note_loss(const Ref& unit, Loss loss);  // blames the unit, until the process is back
  void forgive_losses(uint64_t process);
  // Losses older than `patience_ms` count as crashes. Calls `failed` for units that certainly failed too
  // often.
  template <class Failed>
  void judge_losses(int64_t now, int64_t patience_ms, const Failed& failed) {
    const auto due = [&](const Loss& loss) { return now - loss.when > patience_ms; };
    for (const Loss& loss : losses_)
      if (due(loss) && judge(loss)) failed(find(loss.job, loss.unit), loss.reason);
    std::erase_if(losses_, due);
  }

  // What breaks the invariant, in words; empty: nothing.
  std::string audit() const;

 private:
  Job& edit(JobId id);
  bool judge(const Loss& loss);
  std::string audit_unit(const Job& job, uint64_t id, const Unit& unit) const;
  std::string audit_job(JobId id, const Job& job) const;

  const FarmRules& rules_;
  const TrustTable& trust_;
  std::map<JobId, Job> jobs_;
  std::vector<Loss> losses_;
  uint64_t next_ticket_ = 1;
};

}  // namespace kiln
