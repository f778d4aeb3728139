// The farm's scheduling as a pure state machine: which worker holds which unit of which job. Takes events and
// the time, returns actions; contains no clock, network, disk or thread, so that a seeded simulation can
// kill, delay and lie.
//
// A unit is a pure function of its job, so it may run anywhere any number of times; only settling is
// exclusive. A lease therefore never decides whether an answer is valid. An answer counts as a vote of its
// worker's voter: its owner, or its machine where owners are not known. It is acknowledged once it is on
// disk, and becomes the unit's result once, in addition, as many voters gave it as the job (quorum) and the
// worker's history (dose of verification) require.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "coordinator/farm/ledger/actions.h"
#include "coordinator/farm/ledger/fair_share.h"
#include "coordinator/farm/ledger/verification.h"

namespace kiln {

struct PassCounts {
  uint32_t number = 0;  // since the coordinator started, from 1
  uint64_t units = 0, done = 0, failed = 0;
  double weight = 0, weight_done = 0;
};

struct JobCounts {
  uint32_t workers = 0, threads = 0;      // assigned to the job now
  uint64_t verified = 0, unverified = 0;  // of the results that count
  uint64_t waived = 0;                    // verifications waived because there was only one worker
  uint64_t duplicates = 0, copies = 0, reassigned = 0, lost = 0;
  uint64_t disputes = 0;  // units with differing, undecided answers
};

struct WorkerView {
  JobId job = 0;
  std::string state;  // "baking", "idle", "preparing", "silent", "leaving", "benched"
  uint32_t held = 0, credits = 0;
  uint64_t agreed = 0;
};

class FarmLedger {
 public:
  explicit FarmLedger(const FarmRules& rules) : rules_(rules) {}

  // farm_jobs.cpp. Ids are never reused.
  void add_job(JobId job, const JobTraits& traits);
  // Restores what an earlier coordinator stored; call before the first pass and after restore_trust().
  void restore(JobId job, std::span<const KnownAnswer> answers);
  void change_job(JobId job, int32_t priority, bool paused, int64_t now, Actions& out);
  // The job is done, failed or cancelled: drops its units and notifies workers.
  void end_job(JobId job, const std::string& reason, int64_t now, Actions& out);
  // Hands out the units in order. Those with a settled result of the same shape are delivered immediately.
  void begin_pass(JobId job, std::span<const UnitPlan> units, int64_t now, Actions& out);
  // Ends the pass with the results delivered so far (time limit).
  void abandon_pass(JobId job, int64_t now, Actions& out);
  bool has_job(JobId job) const { return jobs_.count(job) > 0; }
  bool pass_complete(JobId job) const;
  PassCounts pass(JobId job) const;
  JobCounts counts(JobId job) const;
  Verification verification(JobId job) const;  // reads every unit
  bool knows(JobId job, uint64_t unit) const;
  const std::string& numeric_class(JobId job) const;
  const std::string& user(JobId job) const;
  // How long no present worker could continue the pass although units are left; -1: one can.
  int64_t stuck_ms(JobId job, int64_t now) const;
  // Hands out nothing while the store cannot write; still accepts messages.
  void hold(bool on, int64_t now, Actions& out);

  // farm_workers.cpp
  void join(WorkerId worker, const WorkerTraits& traits, int64_t now, Actions& out);
  // Sets the worker's class for the job's kernels, after which its results count.
  void prove(WorkerId worker, JobId job, const std::string& numeric_class);
  // The worker is ready for the job: it may hold at most `credits` units; it already holds `held`.
  void ready(WorkerId worker, JobId job, const std::string& numeric_class, uint32_t credits,
             std::span<const uint64_t> held, int64_t now, Actions& out);
  void job_refused(WorkerId worker, JobId job, const Error& error, int64_t now, Actions& out);
  void heard(WorkerId worker, int64_t now, Actions& out);
  // The connection ended. `crashed`: without a goodbye, so one of the worker's units may be to blame.
  void leave(WorkerId worker, bool crashed, const std::string& reason, int64_t now, Actions& out);
  // The worker drains; it has not started `unbegun` of `job`.
  void drain(WorkerId worker, std::span<const uint64_t> unbegun, int64_t now, Actions& out);
  void tick(int64_t now, Actions& out);
  uint32_t present() const;  // workers eligible for units
  bool is_member(WorkerId worker) const { return workers_.count(worker) > 0; }
  size_t held(WorkerId worker) const;
  bool is_banned(WorkerId worker, JobId job) const;  // whether it cannot bake this job
  WorkerView view(WorkerId worker, int64_t now) const;

  // farm_answers.cpp. `digest` was recomputed by the caller, shape and numbers were checked.
  void result(WorkerId worker, JobId job, uint64_t unit, const Digest& digest, int64_t now, Actions& out);
  void stored(JobId job, uint64_t unit, uint64_t ticket, int64_t now, Actions& out);
  void unit_failed(WorkerId worker, JobId job, uint64_t unit, const Error& error, int64_t now, Actions& out);
  // The worker had another unit of this number, from before a rewind or a restart: nobody's fault.
  void hand_back(WorkerId worker, JobId job, uint64_t unit, int64_t now, Actions& out);
  // A stored answer cannot be read back: bake it again.
  void damaged(JobId job, uint64_t unit, int64_t now, Actions& out);

  // farm_trust.cpp
  void restore_trust(const std::string& identity, uint64_t agreed, const std::string& quarantined_for);
  void quarantine(const std::string& identity, const std::string& reason, int64_t now, Actions& out);
  void forgive(const std::string& identity);
  const std::string* quarantined_for(const std::string& identity) const;  // nullptr: not quarantined

  // why.cpp: the deciding rule and its numbers, one sentence each.
  std::vector<std::string> why_job(JobId job, int64_t now) const;
  std::vector<std::string> why_unit(JobId job, uint64_t unit, int64_t now) const;
  std::vector<std::string> why_worker(WorkerId worker, int64_t now) const;
  double used_thread_ms(const std::string& user) const { return share_.used_ms(user); }

  // Checks counters against the state they count, for tests; returns a description of the fault, or nothing.
  std::string audit() const;

 private:
  using IdentityId = uint32_t;
  using VoterId = uint32_t;
  static constexpr VoterId kUnknownVoter = 0;
  struct Identity {
    std::string name;
    VoterId voter = kUnknownVoter;
    uint64_t agreed = 0;
    bool quarantined = false;
    std::string reason;
  };
  struct Answer {
    Digest digest;
    std::vector<IdentityId> voters;
    bool stored = false;
    uint64_t ticket = 0;  // identifies the write; the same bytes may be written, revoked and written again
    std::vector<WorkerId> waiting;  // for an acknowledgement
  };
  enum class Phase : uint8_t { kOpen, kSettled, kFailed };
  enum class Queue : uint8_t { kNone, kPending, kSuspect, kSecond };
  struct Unit {
    uint64_t shape = 0;
    double weight = 1;
    uint32_t pass = 0;      // the last pass that requested it
    uint32_t order = 0;     // in that pass
    uint32_t needed = 0;    // equal votes needed; 0: undecided
    uint32_t attempts = 0;  // that cost a worker or failed: makes it a suspect
    uint32_t failures = 0;  // failures certainly caused by the unit
    uint32_t unjudged = 0;  // losses of workers that held nothing else and may still come back
    Phase phase = Phase::kOpen;
    Queue queue = Queue::kNone;
    bool verified = false, delivered = false, copied = false, disputed = false;
    std::vector<uint64_t> leases;
    std::vector<Answer> answers;  // settled unit: only its result, with its voters
    std::vector<IdentityId> blamed;
    Digest merged;  // of a delivered unit
  };
  struct Speed {          // over a job's ready workers with known rate
    int64_t when = -1;    // time computed; -1: not yet
    double rate = 0;      // of all, weight per ms
    double least_ms = 0;  // per weight, on a thread of the fastest
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
    bool suspected = false;                          // some unit has cost a worker
    std::set<std::pair<size_t, WorkerId>> backlogs;  // (units not started, worker): candidates to steal from
    std::set<uint64_t> leases;                       // oldest first
    PassCounts counts;
    JobCounts totals;
    uint32_t disputes = 0;
    double copied_weight = 0, turnaround_ms = 0, turnaround_weight = 0;
    mutable Speed speed;
    int64_t searched_at = 0;   // for units to steal or copy
    uint32_t searches = 0;     // fruitless searches since then
    int64_t alone_since = -1;  // since when no second identity could answer
    bool alone = false;
    bool spare = false;        // at the last tick: a worker held units it had not started, or was late
    int64_t stuck_since = -1;  // since when no worker of its class could take the rest
    std::map<WorkerId, std::string> other_class;  // unused workers and their class
  };
  struct Lease {
    WorkerId worker;
    JobId job;
    uint64_t unit;
    int64_t since;
  };
  enum class Presence : uint8_t { kActive, kSilent, kDraining };
  struct Worker {
    WorkerTraits traits;
    IdentityId identity = 0;
    Presence presence = Presence::kActive;
    int64_t last_heard = 0;
    JobId job = 0;  // 0: none
    bool ready = false, leaving = false;
    uint32_t credits = 0;
    std::set<uint64_t> held;  // leases
    double held_weight = 0;
    int64_t assigned_at = 0, charged_until = 0, busy_since = 0, benched_until = 0;
    double rate = 0;                  // weight per ms of the whole worker; 0: not known
    std::set<uint64_t> failed_units;  // in a row
    uint32_t benched = 0;
    size_t ghosts = 0;  // units reassigned while it was silent, which may still occupy its threads
    std::map<JobId, std::string> banned;
    std::map<JobId, std::string> classes;  // proven for the job's kernels
    std::optional<UserId> counted_for;     // the user charged for its threads
  };

  // farm_jobs.cpp
  Job* find_job(JobId job);
  const Job* find_job(JobId job) const;
  Unit* find_unit(Job& job, uint64_t unit);
  void enqueue(Job& job, uint64_t id, Unit& unit);
  void dequeue(Job& job, uint64_t id, Unit& unit);
  void deliver(JobId id, Job& job, uint64_t unit_id, Unit& unit, Actions& out);
  void complete_if_done(JobId id, Job& job, Actions& out);
  void rewind(JobId id, Job& job, const std::string& reason, Actions& out);

  // farm_workers.cpp
  Worker* find_worker(WorkerId worker);
  void release(uint64_t lease);
  static void note_backlog(Job& job, WorkerId id, const Worker& worker, size_t held_before);
  void revoke_all(Worker& worker);
  void charge(Worker& worker, int64_t now);
  void find_silent(int64_t now, bool was_away, Actions& out);
  void find_hung(int64_t now, Actions& out);
  void forgive_losses(uint64_t process);
  void judge_losses(int64_t now, Actions& out);
  void waive_audits(int64_t now, Actions& out);
  void change_class(int64_t now, Actions& out);

  // farm_answers.cpp
  uint64_t lease_of(WorkerId worker, const Unit& unit) const;  // 0: none
  void vote(JobId id, Job& job, uint64_t unit_id, Unit& unit, WorkerId worker, const Digest& digest,
            int64_t now, Actions& out);
  void count_again(IdentityId who, int64_t now, Actions& out);
  void conclude(JobId id, Job& job, uint64_t unit_id, Unit& unit, int64_t now, Actions& out);
  void settle(JobId id, Job& job, uint64_t unit_id, Unit& unit, size_t winner, int64_t now, Actions& out);
  void dispute(JobId id, Job& job, uint64_t unit_id, Unit& unit, Actions& out);
  void blame(JobId id, Job& job, uint64_t unit_id, Unit& unit, IdentityId who, bool certain,
             const std::string& reason, Actions& out);
  void give_up(JobId id, Job& job, uint64_t unit_id, Unit& unit, const std::string& reason, Actions& out);
  uint32_t needed_votes(JobId id, const Job& job, uint64_t unit_id, IdentityId first) const;

  // why.cpp
  const char* voter_word() const;
  std::string why_quorum(const Job& job) const;

  // farm_trust.cpp
  IdentityId intern(const std::string& name);
  VoterId intern_voter(const std::string& name);
  bool same_voter(IdentityId a, IdentityId b) const;
  size_t votes(const Answer& answer) const;  // of different voters
  bool voted(const Unit& unit, IdentityId who) const;
  void agree(IdentityId id, Actions& out);
  void quarantine(IdentityId id, const std::string& reason, int64_t now, Actions& out);
  void bench(WorkerId id, Worker& worker, int64_t now, Actions& out);

  // farm_grants.cpp
  void serve(WorkerId id, int64_t now, Actions& out);
  void serve_all(JobId job, int64_t now, Actions& out);  // job 0: all workers
  bool grant_one(WorkerId id, Worker& worker, Job& job, int64_t now, Actions& out);
  void grant(WorkerId id, Worker& worker, Job& job, uint64_t unit_id, int64_t now, Actions& out);
  // Units; 0: none.
  uint64_t choose_suspect(const Worker& worker, const Job& job) const;
  uint64_t choose_second(const Worker& worker, const Job& job) const;
  uint64_t choose_steal(WorkerId id, const Worker& worker, Job& job, WorkerId& from);
  uint64_t choose_copy(WorkerId id, const Job& job, int64_t now) const;  // worker 0: for any worker
  bool would_end_late(const Worker& worker, const Job& job, double weight, int64_t now) const;
  void reckon_speed(JobId id, const Job& job, int64_t now) const;
  bool holds_suspect(const Worker& worker) const;

  // farm_assign.cpp
  JobId pick_job(const Worker& worker) const;
  bool has_work(const Job& job, const Worker& worker) const;
  bool may_work(JobId id, const Job& job, const Worker& worker) const;
  void assign(WorkerId id, Worker& worker, JobId job, int64_t now, Actions& out);
  void unassign(Worker& worker, int64_t now);
  void count_for(Worker& worker, std::optional<UserId> user);
  double turn(const Job& job, double more_threads) const;
  void balance(int64_t now);
  void wake_users();
  void find_spare(int64_t now);

  struct Loss {  // a lost connection: a crash, unless the process comes back
    uint64_t process;
    IdentityId identity;
    int64_t when;
    bool certain;  // the worker held nothing else
    JobId job;
    uint64_t unit;
    std::string reason;
  };

  FarmRules rules_;
  std::map<JobId, Job> jobs_;
  std::map<WorkerId, Worker> workers_;
  std::unordered_map<uint64_t, Lease> leases_;
  std::vector<Identity> identities_;
  std::map<std::string, IdentityId> identity_by_name_;
  std::map<std::string, VoterId> voter_by_name_;
  FairShare share_;
  uint64_t next_lease_ = 1, next_ticket_ = 1;
  int64_t last_tick_ = 0, served_all_at_ = 0;
  bool held_ = false;
  std::vector<Loss> losses_;
};

}  // namespace kiln
