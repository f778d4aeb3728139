// The farm's scheduling as a pure state machine: which worker holds which unit of which job. Takes events and
// the time, returns actions; contains no clock, network, disk or thread, so that a seeded simulation can
// kill, delay and lie.
//
// A unit is a pure function of its job, so it may run anywhere any number of times; only settling is
// exclusive. A lease therefore never decides whether an answer is valid. An answer counts as a vote of its
// worker's voter: its owner, or its machine where owners are not known. It is acknowledged once it is on
// disk, and becomes the unit's result once, in addition, as many voters gave it as the job (quorum) and the
// worker's history (dose of verification) require.
//
// Four tables hold the state, each its own invariant: TrustTable, UnitTable, WorkerTable and Grants. The
// ledger turns an event into what that means for each of them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "coordinator/farm/ledger/grants.h"
#include "coordinator/farm/ledger/listened_time.h"

namespace kiln {

struct WorkerView {
  JobId job = 0;
  std::string state;  // "baking", "idle", "preparing", "silent", "leaving", "benched"
  uint32_t held = 0, credits = 0;
  uint64_t agreed = 0;
};

class FarmLedger {
 public:
  // `now` of all verbs: ms of one clock. While no verb is called for half a lease, no patience runs out.
  explicit FarmLedger(const FarmRules& rules) : rules_(rules) {}
  FarmLedger(const FarmLedger&) = delete;  // the tables refer to each other
  FarmLedger& operator=(const FarmLedger&) = delete;

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
  bool has_job(JobId job) const { return units_.find(job) != nullptr; }
  bool pass_complete(JobId job) const;
  PassCounts pass(JobId job) const;
  JobCounts counts(JobId job) const;
  Verification verification(JobId job) const { return units_.verification(job); }  // reads every unit
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
  uint32_t present() const { return workers_.present(); }  // workers eligible for units
  bool is_member(WorkerId worker) const { return workers_.find(worker) != nullptr; }
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
  void forgive(const std::string& identity) { trust_.restore(identity, 0, ""); }
  const std::string* quarantined_for(const std::string& identity) const {  // nullptr: not quarantined
    return trust_.quarantined_for(identity);
  }

  // why.cpp: the deciding rule and its numbers, one sentence each.
  std::vector<std::string> why_job(JobId job, int64_t now) const;
  std::vector<std::string> why_unit(JobId job, uint64_t unit, int64_t now) const;
  std::vector<std::string> why_worker(WorkerId worker, int64_t now) const;
  double used_thread_ms(const std::string& user) const { return workers_.share().used_ms(user); }

  // Checks the invariants of all four tables, for tests; returns a description of the fault, or nothing.
  std::string audit() const;

 private:
  using UnitRef = UnitTable::Ref;
  using WorkerRef = WorkerTable::Ref;
  using Answer = UnitTable::Answer;
  using Phase = UnitTable::Phase;
  using Queue = UnitTable::Queue;
  using Presence = WorkerTable::Presence;

  // farm_jobs.cpp
  void rewind(JobId job, const std::string& reason, Actions& out);

  // farm_workers.cpp
  void revoke_all(const WorkerRef& worker);
  void lose_units(const WorkerRef& worker, const std::string& reason, int64_t now);
  void hear(WorkerId worker, int64_t now, Actions& out);
  void find_silent(int64_t now, Actions& out);
  void find_unready(const WorkerRef& worker, int64_t now, Actions& out);
  void find_hung(const WorkerRef& worker, int64_t now, Actions& out);
  void judge_losses(int64_t now, Actions& out);
  void waive_audits(int64_t now, Actions& out);
  void find_stuck(int64_t now, Actions& out);
  std::string better_class(JobId job) const;  // empty: none
  void change_class(JobId job, const std::string& better, int64_t now, Actions& out);

  // farm_answers.cpp
  void vote(const UnitRef& unit, const WorkerRef& worker, const Digest& digest, int64_t now, Actions& out);
  // Whether that ends the matter: the identity has answered before, or the unit has a result.
  bool vote_again(const UnitRef& unit, const WorkerRef& worker, const Digest& digest, int64_t now,
                  Actions& out);
  bool vote_late(const UnitRef& unit, const WorkerRef& worker, const Digest& digest, int64_t now,
                 Actions& out);
  void count_again(IdentityId who, int64_t now, Actions& out);
  void conclude(const UnitRef& unit, int64_t now, Actions& out);
  void settle(const UnitRef& unit, size_t winner, int64_t now, Actions& out);
  void dispute(const UnitRef& unit, Actions& out);
  void blame(const UnitRef& unit, const WorkerRef& worker, bool certain, const std::string& reason,
             Actions& out);
  void give_up(const UnitRef& unit, const std::string& reason, Actions& out);
  uint32_t needed_votes(const UnitRef& unit, IdentityId first) const;

  // farm_trust.cpp
  void quarantine(IdentityId id, const std::string& reason, int64_t now, Actions& out);
  void bench(const WorkerRef& worker, int64_t now, Actions& out);

  // farm_grants.cpp
  void serve(WorkerId worker, int64_t now, Actions& out);
  void serve_all(JobId job, int64_t now, Actions& out);  // job 0: all workers
  bool may_serve(const WorkerTable::Worker& worker, int64_t now) const;
  bool grant_one(const WorkerRef& worker, int64_t now, Actions& out);
  bool grant_more(const WorkerRef& worker, int64_t now, Actions& out);
  void grant(const WorkerRef& worker, const UnitRef& unit, int64_t now, Actions& out);
  void assign(const WorkerRef& worker, JobId job, int64_t now, Actions& out);
  void wake_users();
  void balance(int64_t now);

  // why.cpp
  const char* voter_word() const;
  std::string why_quorum(const UnitTable::Job& job) const;
  void why_elsewhere(JobId job, std::vector<std::string>& lines) const;
  void why_idle(std::vector<std::string>& lines, const WorkerTable::Worker& worker) const;

  FarmRules rules_;
  TrustTable trust_{rules_};
  UnitTable units_{rules_, trust_};
  WorkerTable workers_{units_};
  Grants grants_{rules_, units_, workers_, trust_};
  ListenedTime time_{rules_.lease_ms / 2};
  int64_t last_tick_ = 0, served_all_at_ = 0;
  bool held_ = false;
};

}  // namespace kiln
