// Who holds which unit: the farm's scheduling as a pure state machine. Events and the time go in, actions
// come out; no clock, network or thread inside, so that a seeded simulation can kill, delay and lie.
//
// A unit is a pure function of the job, so it may run anywhere any number of times; only the commit is
// exclusive. A lease number therefore never decides whether a result is good: the first result of a unit
// is committed whoever sends it, a later one must have the same digest and is dropped.
#pragma once

#include <deque>
#include <map>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <variant>
#include <vector>

#include "common/base/hash.h"
#include "common/base/status.h"

namespace kiln {

using WorkerId = uint32_t;

struct LedgerSettings {
  int64_t lease_ms = 15000;   // silence after which a worker's units go to others
  uint32_t max_attempts = 3;  // workers a unit may cost before the pass fails
  bool duplicate_every_unit = false;
};

// Actions, to be carried out in their order.
struct Grant {
  WorkerId worker;
  uint64_t lease;
  uint64_t unit;
};
struct Commit {  // of the result that was just reported
  WorkerId worker;
  uint64_t unit;
};
struct Acknowledge {  // the worker may forget the result
  WorkerId worker;
  uint64_t unit;
  Digest digest;
};
struct Expel {  // tell the worker why and close its connection; then call leave()
  WorkerId worker;
  std::string reason;
};
struct Note {  // for the report
  std::string text;
};
struct FailPass {
  Error error;
};
using Action = std::variant<Grant, Commit, Acknowledge, Expel, Note, FailPass>;
using Actions = std::vector<Action>;

class Ledger {
 public:
  explicit Ledger(const LedgerSettings& settings) : settings_(settings) {}

  // Units are handed out in the order given. Ids are unique in the job.
  void begin_pass(std::span<const uint64_t> units, int64_t now, Actions& out);
  // Units that are not committed are given up; results of them are acknowledged and dropped from now on.
  void end_pass();
  // Every unit is committed (and answered twice where that was asked for).
  bool complete() const { return done_ == units_.size() && audits_open_ == 0; }

  // The worker is ready for the job: at most `credits` units may be with it, `threads` run at a time. The
  // first worker's numeric class is the job's. Also for a worker that left and came back.
  void join(WorkerId worker, const std::string& name, const std::string& numeric_class, uint32_t threads,
            uint32_t credits, int64_t now, Actions& out);
  void heard(WorkerId worker, int64_t now, Actions& out);
  // The connection ended. `crashed`: not in order, so one of the worker's units may be to blame.
  void leave(WorkerId worker, bool crashed, const std::string& reason, int64_t now, Actions& out);
  // The worker wants no more; it has not begun `unbegun`.
  void drain(WorkerId worker, std::span<const uint64_t> unbegun, int64_t now, Actions& out);
  // A well-formed result. `digest` was recomputed by the caller.
  void result(WorkerId worker, uint64_t lease, uint64_t unit, const Digest& digest, int64_t now,
              Actions& out);
  void unit_failed(WorkerId worker, uint64_t lease, uint64_t unit, const Error& error, int64_t now,
                   Actions& out);
  void tick(int64_t now, Actions& out);

  bool asked_for(uint64_t unit) const;  // now or in an earlier pass
  uint64_t committed() const { return done_; }
  uint32_t present() const;  // workers that would get units
  bool is_member(WorkerId worker) const;
  size_t held(WorkerId worker) const;
  const std::string& numeric_class() const { return class_; }
  uint64_t duplicates() const { return duplicates_; }
  uint64_t reassigned() const { return reassigned_; }
  uint64_t lost() const { return lost_; }

 private:
  struct UnitState {
    bool committed = false;
    bool copied = false;  // has had its one speculative copy
    bool queued = false;  // waits in pending_ or suspects_
    bool audit = false;   // waits for, or is out for, its second answer
    uint32_t leases = 0;  // active
    std::set<WorkerId> blamed;
    uint32_t attempts = 0;
    WorkerId committer = 0;
  };
  struct Lease {
    WorkerId worker;
    uint64_t unit;
    int64_t since;
  };
  enum class Presence { kActive, kSilent, kDraining, kGone };
  struct Worker {
    std::string name;
    uint32_t threads = 1, credits = 0;
    Presence presence = Presence::kActive;
    int64_t last_heard = 0;
    std::set<uint64_t> held;  // leases
  };

  UnitState* find_unit(uint64_t unit);  // of this pass
  Worker* find_worker(WorkerId worker);
  void release(uint64_t lease);
  void requeue(uint64_t unit, bool suspect);
  void blame(uint64_t unit, WorkerId worker, bool certain, const std::string& reason, Actions& out);
  void revoke_all(Worker& worker);
  void settle_duplicate(const Worker& worker, uint64_t unit, const Digest& digest, Actions& out);
  void fail_pass(ErrorKind kind, std::string message, Actions& out);

  // ledger_grants.cpp: who gets what next.
  void grant_all(int64_t now, Actions& out);
  bool grant_one(WorkerId id, Worker& worker, int64_t now, Actions& out);
  std::deque<uint64_t>::iterator choose_suspect(WorkerId id);
  const Lease* choose_copy(WorkerId id, int64_t now) const;
  std::deque<uint64_t>::iterator choose_audit(WorkerId id);
  bool holds_suspect(const Worker& worker) const;

  LedgerSettings settings_;
  std::unordered_map<uint64_t, UnitState> units_;  // of this pass
  std::deque<uint64_t> pending_, suspects_, audits_;
  std::map<uint64_t, Lease> leases_;  // by number: oldest first
  std::map<WorkerId, Worker> workers_;
  std::unordered_map<uint64_t, Digest> digests_;  // committed, of all passes
  std::unordered_set<uint64_t> abandoned_;
  std::string class_;
  uint64_t next_lease_ = 1, done_ = 0, audits_open_ = 0;
  uint64_t duplicates_ = 0, reassigned_ = 0, lost_ = 0;
  int64_t last_tick_ = 0, turnaround_sum_ = 0;
  uint64_t turnaround_count_ = 0;
  bool failed_ = false;
};

}  // namespace kiln
